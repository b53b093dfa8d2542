//! Flags that override a plant's file.

use std::path::PathBuf;

use session::NetworkFlags;
use shell::health::HealthFlags;
use vocabulary::RunId;

use super::speed::Speed;

/// What a command line may set of a plant.
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
