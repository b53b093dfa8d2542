//! What `trusswatch study` takes.

use std::num::NonZeroUsize;
use std::path::PathBuf;

/// Which diagnosers are studied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum PresetName {
    /// As the paper has them: growing interval, demand residual, thresholds from the maximum, no
    /// hold, only actuators explain
    Paper,
    /// As the shipped daemons run
    Default,
}

/// Try the diagnosers on many random scenarios, and say what comes of it
///
/// Each scenario is a run of the simulated tower with a random fault of a random component in a random
/// wind; each nominal run is one without a fault. A run follows from the seed and its own number alone:
/// the result does not depend on the number of jobs, and a campaign can be interrupted, gone on with
/// and extended (with --out).
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Which diagnosers are studied
    #[arg(long, value_enum, default_value = "default")]
    pub(super) preset: PresetName,
    /// Other diagnosers than the preset's: their configurations, in the order of the structure
    #[arg(long = "module", value_name = "MODULE.toml", requires = "plant")]
    pub(super) modules: Vec<PathBuf>,
    /// Another plant than the shipped one
    #[arg(long, value_name = "PLANT.toml", requires = "modules")]
    pub(super) plant: Option<PathBuf>,
    /// Runs with a fault
    #[arg(long, default_value_t = 300, value_name = "N")]
    pub(super) scenarios: u64,
    /// Runs without a fault
    #[arg(long, default_value_t = 0, value_name = "M")]
    pub(super) nominal: u64,
    /// Length of a run without a fault [s]
    #[arg(long, default_value_t = 15.0, value_name = "T", allow_hyphen_values = true)]
    pub(super) nominal_seconds: f64,
    /// Seed of the campaign
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Runs at a time; by default as many as there are processors
    #[arg(long, value_name = "J")]
    jobs: Option<NonZeroUsize>,
    /// By how much each run's plant differs from what is believed of it, e.g. 0.1
    #[arg(long, default_value_t = 0.0, value_name = "X", allow_hyphen_values = true)]
    pub(super) mismatch: f64,
    /// Keep everything in this directory: what is done (so that the same command goes on with it),
    /// summary, tables, figures, and a report to look at
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub(super) json: bool,
    /// Measure how likely faults are found by their size, with this many runs for each size
    #[arg(long, value_name = "RUNS", num_args = 0..=1, default_missing_value = "60")]
    pub(super) power: Option<u64>,
    /// Compare the four combinations of rule and actuator residual on the same scenarios
    #[arg(long, conflicts_with_all = ["power", "out"])]
    pub(super) compare: bool,
    /// The scenario to explain
    #[arg(long, value_name = "K", requires = "explain")]
    pub(super) scenario: Option<u64>,
    /// Replay one scenario and say in words what happened
    #[arg(long, requires = "scenario", conflicts_with_all = ["power", "compare", "out", "export_residuals"])]
    pub(super) explain: bool,
    /// Write the residuals of every run with the truth beside them into this directory, one table
    /// (CSV) a run, for other detectors
    #[arg(long, value_name = "DIR", conflicts_with_all = ["power", "compare", "out"])]
    pub(super) export_residuals: Option<PathBuf>,
}

impl Arguments {
    /// Runs at a time.
    pub(super) fn jobs(&self) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        self.jobs.map_or(processors, NonZeroUsize::get)
    }
}
