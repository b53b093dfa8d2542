//! What the subcommands of `trusswatch study` take.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use study::Controller;

use super::conditions::Arguments as ConditionsArguments;
use super::identify::Arguments as IdentifyArguments;
use super::limits::Arguments as LimitsArguments;
use crate::table::WidthArguments;

/// Which diagnosers are studied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum PresetName {
    /// As the paper has them: growing interval, demand residual, thresholds from the maximum, no
    /// hold, only actuators explain
    Paper,
    /// As the shipped daemons run
    Default,
}

/// Evaluate the diagnosers on many random scenarios
///
/// Each scenario is a run of the simulated tower with a random fault of a random component in a random
/// wind; each nominal run is one without a fault. A run follows from the seed and its own number alone:
/// the result does not depend on the number of jobs.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    Run(RunArguments),
    Power(PowerArguments),
    Histories(HistoriesArguments),
    Conditions(ConditionsArguments),
    Limits(LimitsArguments),
    Identify(IdentifyArguments),
    Compare(CompareArguments),
    Explain(ExplainArguments),
    Export(ExportArguments),
}

/// Which campaign.
#[derive(Debug, Args)]
pub(super) struct CampaignArguments {
    /// Which diagnosers are studied
    #[arg(long, value_enum, default_value = "default")]
    pub(super) preset: PresetName,
    /// Other diagnosers than the preset's: their configurations, in the order of the structure
    #[arg(long = "config", value_name = "MODULE.toml", requires = "plant")]
    pub(super) modules: Vec<PathBuf>,
    /// Another plant than the shipped one
    #[arg(long, value_name = "PLANT.toml", requires = "modules")]
    pub(super) plant: Option<PathBuf>,
    /// Seed of the campaign
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Mismatch of each run's plant against the nominal model, e.g. 0.1
    #[arg(long, default_value_t = 0.0, value_name = "X", allow_hyphen_values = true)]
    pub(super) mismatch: f64,
    /// Controllers of the plant, which the runs have in turn
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        default_value = "shipped",
        value_name = "NAME,…"
    )]
    pub(super) controllers: Vec<ControllerName>,
}

/// How the simulated plant is controlled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum ControllerName {
    /// As the plant's file has it
    Shipped,
    /// Demands hardly move
    Gentle,
    /// Demands jump
    Aggressive,
    /// Demands jump as far as a low limit
    Saturating,
}

impl From<ControllerName> for Controller {
    fn from(name: ControllerName) -> Self {
        match name {
            ControllerName::Shipped => Controller::Shipped,
            ControllerName::Gentle => Controller::Gentle,
            ControllerName::Aggressive => Controller::Aggressive,
            ControllerName::Saturating => Controller::Saturating,
        }
    }
}

/// How many runs, and how many at a time.
#[derive(Debug, Args)]
pub(super) struct RunsArguments {
    /// Runs with a fault
    #[arg(long, default_value_t = 300, value_name = "N")]
    pub(super) scenarios: u64,
    /// Runs without a fault
    #[arg(long, default_value_t = 0, value_name = "M")]
    pub(super) nominal: u64,
    /// Length of a run without a fault [s]
    #[arg(long, default_value_t = 15.0, value_name = "T", allow_hyphen_values = true)]
    pub(super) nominal_seconds: f64,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
}

#[derive(Debug, Clone, Copy, Args)]
pub(super) struct JobsArguments {
    /// Runs at a time; by default as many as there are processors
    #[arg(long, value_name = "J")]
    jobs: Option<NonZeroUsize>,
}

impl JobsArguments {
    /// Runs at a time.
    pub(super) fn count(self) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        self.jobs.map_or(processors, NonZeroUsize::get)
    }
}

/// What the subcommands have in common that make the runs of a campaign.
#[derive(Debug, Args)]
pub(super) struct CommonArguments {
    #[command(flatten)]
    pub(super) campaign: CampaignArguments,
    #[command(flatten)]
    pub(super) runs: RunsArguments,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// Make a campaign: isolation, delays, false alarms, the paper's table
///
/// It can be interrupted, resumed and extended (with --out).
#[derive(Debug, Args)]
pub(super) struct RunArguments {
    #[command(flatten)]
    pub(super) common: CommonArguments,
    /// Keep everything in this directory: completed runs (from which the same command resumes),
    /// summary, tables, figures, and a report to look at
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    #[command(flatten)]
    pub(super) width: WidthArguments,
}

/// Measure how likely faults are isolated by their size
#[derive(Debug, Args)]
pub(super) struct PowerArguments {
    #[command(flatten)]
    pub(super) campaign: CampaignArguments,
    /// Runs for each size
    #[arg(long, default_value = "60", value_name = "N")]
    pub(super) runs: std::num::NonZeroU64,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Write the figure into this file
    #[arg(long, value_name = "FILE.svg")]
    pub(super) svg: Option<PathBuf>,
    /// Print one JSON object instead of a table
    #[arg(long)]
    pub(super) json: bool,
}

/// Go through random histories: faults that come, go, come again and overlap, lost samples, restarts
///
/// A history follows from the seed and its own number alone. A healthy component that is named is a defect
/// of the diagnosis: the command then fails, and says how to look at that history.
#[derive(Debug, Args)]
pub(super) struct HistoriesArguments {
    #[command(flatten)]
    pub(super) campaign: CampaignArguments,
    /// How many histories
    #[arg(long, default_value = "200", value_name = "N")]
    pub(super) histories: std::num::NonZeroU64,
    /// Number of the first of them
    #[arg(long, default_value_t = 0, value_name = "K")]
    pub(super) from: u64,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Go through the first of them only, and print what happens
    #[arg(long)]
    pub(super) show: bool,
    /// Print one JSON object instead of a table
    #[arg(long, conflicts_with = "show")]
    pub(super) json: bool,
}

/// Compare the four combinations of rule and actuator residual on the same scenarios
#[derive(Debug, Args)]
pub(super) struct CompareArguments {
    #[command(flatten)]
    pub(super) common: CommonArguments,
    #[command(flatten)]
    pub(super) width: WidthArguments,
}

/// Replay one scenario and describe what happened
#[derive(Debug, Args)]
pub(super) struct ExplainArguments {
    /// Number of the scenario in its campaign, from 0
    #[arg(value_name = "K")]
    pub(super) scenario: u64,
    #[command(flatten)]
    pub(super) campaign: CampaignArguments,
}

/// Write the residuals of every run with the truth beside them, one CSV table a run, for other
/// detectors
#[derive(Debug, Args)]
pub(super) struct ExportArguments {
    /// The directory to write into
    #[arg(value_name = "DIR")]
    pub(super) directory: PathBuf,
    #[command(flatten)]
    pub(super) common: CommonArguments,
}

/// Reads one of these by its name.
pub(super) fn named<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(all.map(name))
        .try_map(move |given| all.into_iter().find(|one| name(*one) == given).ok_or("no such name"))
}
