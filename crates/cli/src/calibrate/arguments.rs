//! What `trusswatch calibrate` takes, and what of it does not go together.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use crate::failure::Failure;
use tables::TableFlags;

/// Factor on the largest divergence, if nothing else is asked for.
const USUAL_MARGIN: f64 = 2.5;

/// How thresholds are made of nominal divergences.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Method {
    /// The largest divergence of each channel, times a margin
    Max,
    /// Where the tail of each channel's peaks is reached as often as is tolerated
    Tail,
}

/// Make thresholds from data without a fault
///
/// The modules' own configurations say which detection the thresholds are for and into which file they
/// are written. The data are simulated: each run has a plant of its own, with another wind and other
/// loads, and differs from the nominal model by up to the mismatch. Or they are recorded: files of
/// `trusswatch record` (MCAP), of which several are one recording, or tables of residuals (of `trusswatch export
/// --residuals`, CSV, or what a logger exports) with a header row, a column for each component of a module, named
/// `module1/sensor/g5/residual` or `module1/sensor/g5`, and possibly one of steps or times; each row is one step, each
/// file a run. With one configuration, the module's name may be left out. A row without all values of a module is a gap
/// of the module.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Configurations of the diagnosers, one for each equipped module, in the order of the structure
    #[arg(required = true, value_name = "MODULE.toml")]
    pub(super) modules: Vec<PathBuf>,
    /// How thresholds are made of the divergences
    #[arg(long, value_enum, default_value_t = Method::Max)]
    pub(super) method: Method,
    /// Factor on the largest divergence [method max, default: 2.5]
    #[arg(long, value_name = "FACTOR", allow_hyphen_values = true)]
    margin: Option<f64>,
    /// False alarms per hour, of all channels together, that are tolerated [method tail]
    #[arg(
        long,
        value_name = "RATE",
        required_if_eq("method", "tail"),
        conflicts_with = "margin",
        allow_hyphen_values = true
    )]
    false_alarms_per_hour: Option<f64>,
    /// Recorded data instead of simulated runs
    #[arg(
        long,
        value_name = "FILE.csv|FILE.mcap",
        num_args = 1..,
        conflicts_with_all = ["plant", "runs", "seconds", "first_seed", "mismatch", "jobs"]
    )]
    pub(super) recorded: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) table: TableFlags,
    #[command(flatten)]
    pub(super) simulation: NominalRunFlags,
}

/// Which runs are simulated.
#[derive(Debug, clap::Args)]
pub(super) struct NominalRunFlags {
    /// Configuration of the plant
    #[arg(
        long,
        value_name = "FILE",
        required_unless_present = "recorded",
        conflicts_with = "TableFlags"
    )]
    pub(super) plant: Option<PathBuf>,
    /// Number of runs
    #[arg(long, default_value_t = 100, value_name = "N")]
    pub(super) runs: u64,
    /// Length of a run, warm-up included [s]
    #[arg(long, default_value_t = 15.0, value_name = "T")]
    pub(super) seconds: f64,
    /// Seed of the first run; the others follow one by one
    #[arg(long, default_value_t = 1_000_000, value_name = "SEED")]
    pub(super) first_seed: u64,
    /// Mismatch of each run's plant against the nominal model, e.g. 0.1
    #[arg(long, default_value_t = 0.1, value_name = "SHARE")]
    pub(super) mismatch: f64,
    /// Runs at a time; by default as many as there are processors
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

/// How a threshold follows from divergences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ThresholdRule {
    /// The largest, times a margin.
    Max {
        /// The margin.
        margin: f64,
    },
    /// A rate of false alarms of all channels together.
    Tail {
        /// The rate.
        per_hour: f64,
    },
}

impl NominalRunFlags {
    /// Runs at a time.
    pub(super) fn jobs(&self) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        self.jobs.map_or(processors, NonZeroUsize::get)
    }
}

impl Arguments {
    /// The rule, after all figures have been checked.
    pub(super) fn check(&self) -> Result<ThresholdRule, Failure> {
        let refuse = |flag: &str, value: String, use_instead: &str| {
            Err(Failure::usage(format!("`{flag}` is {value}; use {use_instead}")))
        };
        let usable = |x: f64| x.is_finite() && x > 0.0;
        let positive = "a finite number above 0";
        if let Some(margin) = self.margin.filter(|margin| !usable(*margin)) {
            return refuse("--margin", margin.to_string(), positive);
        }
        if let Some(rate) = self.false_alarms_per_hour.filter(|rate| !usable(*rate)) {
            return refuse("--false-alarms-per-hour", rate.to_string(), positive);
        }
        let seconds = self.simulation.seconds;
        if !(seconds > 0.0 && seconds <= 86_400.0) {
            return refuse("--seconds", seconds.to_string(), "above 0 and up to a day");
        }
        if self.simulation.runs == 0 {
            return refuse("--runs", "0".into(), "at least 1");
        }
        self.rule()
    }

    fn rule(&self) -> Result<ThresholdRule, Failure> {
        match (self.method, self.margin, self.false_alarms_per_hour) {
            (Method::Max, margin, None) => {
                Ok(ThresholdRule::Max { margin: margin.unwrap_or(USUAL_MARGIN) })
            }
            (Method::Tail, None, Some(per_hour)) => Ok(ThresholdRule::Tail { per_hour }),
            (Method::Max, _, Some(_)) => Err(Failure::usage(
                "`--false-alarms-per-hour` needs the tail; add `--method tail` or leave it out",
            )),
            (Method::Tail, Some(_), _) => Err(Failure::usage(
                "`--margin` is of `--method max`; leave it out, the tail needs none",
            )),
            (Method::Tail, None, None) => {
                Err(Failure::usage("`--method tail` needs `--false-alarms-per-hour`"))
            }
        }
    }
}
