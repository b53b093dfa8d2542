//! Flags that override or add to a file.

use std::path::{Path, PathBuf};

use truss::ids::RunId;

use super::endpoint::endpoint;
use super::error::ConfigErrors;
use super::health::HealthFlags;
use super::speed::Speed;

/// Endpoints from the command line.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct NetworkFlags {
    /// Listen on this endpoint too, e.g. `tcp/127.0.0.1:7447`; may be repeated
    #[arg(long, value_name = "ENDPOINT")]
    pub listen: Vec<String>,
    /// Connect to this endpoint too; may be repeated
    #[arg(long, value_name = "ENDPOINT")]
    pub connect: Vec<String>,
    /// Show who this is by the certificate in this directory, made by `trusswatch pki issue`, and
    /// accept nothing but mutually authenticated TLS
    #[arg(long, value_name = "DIRECTORY")]
    pub tls: Option<PathBuf>,
}

/// What may be said of a plant on the command line.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct PlantFlags {
    /// Seed of all randomness
    #[arg(long)]
    pub seed: Option<u64>,
    /// `max`, `real` or a factor
    #[arg(long)]
    pub speed: Option<Speed>,
    /// End after this many steps
    #[arg(long)]
    pub steps: Option<u64>,
    /// Faults to inject at given steps
    #[arg(long, value_name = "FILE")]
    pub schedule: Option<PathBuf>,
    /// Number of the run; otherwise the time in microseconds since 1970
    #[arg(long, value_name = "NUMBER", value_parser = run_id)]
    pub run_id: Option<RunId>,
    /// Start at once instead of waiting for the diagnosers
    #[arg(long)]
    pub no_wait: bool,
    /// Where to listen and connect
    #[command(flatten)]
    pub network: NetworkFlags,
    /// Where to serve health
    #[command(flatten)]
    pub health: HealthFlags,
}

fn run_id(text: &str) -> Result<RunId, std::num::ParseIntError> {
    text.parse().map(RunId)
}

/// Checks endpoints from the command line.
pub(super) fn check(flags: &NetworkFlags) -> Result<(), ConfigErrors> {
    let mut errors = ConfigErrors(Vec::new());
    for (flag, endpoints) in [("--listen", &flags.listen), ("--connect", &flags.connect)] {
        for error in endpoints.iter().filter_map(|text| endpoint(text).err()) {
            errors.add(Path::new(flag), None, error);
        }
    }
    errors.or(())
}
