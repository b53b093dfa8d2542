//! What the subcommands of `trusswatch study` take.

use std::num::{NonZeroU64, NonZeroUsize};
use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use serde::{Deserialize, Serialize};
use study::conditions::Situation;
use study::tolerance::{COUNTED_S, ToleranceCampaign};
use study::{ControllerTuning, Shard};
use vocabulary::fault::FaultKind;

use crate::table::WidthArguments;

/// The longest run without a fault \[s\]: a year.
const LONGEST_S: f64 = 365.0 * 86_400.0;
/// Sets of situations, besides single ones.
pub(super) const HIDDEN: &str = "hidden";
pub(super) const HISTORIES: &str = "histories";

/// Evaluate the diagnosers on many random cases
///
/// Each case is a run of the simulated tower and its diagnosers with random faults. It follows from the seed and its own
/// number alone: the result does not depend on the number of jobs, on interruptions, or on shards.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(super) command: StudyCommand,
}

#[derive(Debug, Subcommand)]
pub(super) enum StudyCommand {
    #[command(flatten)]
    Campaign(Box<CampaignRequest>),
    Merge(MergeArguments),
    Compare(CompareArguments),
    Export(ExportArguments),
}

/// A campaign, and everything that its figures follow from.
#[derive(Debug, Clone, Subcommand, Serialize, Deserialize)]
#[serde(tag = "name", rename_all = "snake_case")]
pub(super) enum CampaignRequest {
    Run(RunArguments),
    Conditions(ConditionArguments),
    Limits(LimitArguments),
    Identify(IdentifyArguments),
    Tolerance(ToleranceArguments),
    Rivals(RivalArguments),
}

/// Which diagnosers are studied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum PresetName {
    /// As the paper has them: growing interval, demand residual, thresholds from the maximum, no
    /// hold, only actuators explain
    Paper,
    /// As the shipped daemons run
    Default,
}

/// Weather of the shipped plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Weather {
    /// Wind and noise only, as in `configs/plant.toml`
    None,
    /// Any wind, live loads and temperatures, the same in all modules: `configs/weather/alike.toml`
    Alike,
    /// Other temperatures in each module and member, imperfect gages, pressure sensors and valves:
    /// `configs/weather/uneven.toml`
    Uneven,
}

/// What is studied.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct SystemArguments {
    /// Which diagnosers are studied
    #[arg(long, value_enum, default_value = "default")]
    pub(super) preset: PresetName,
    /// Weather of the shipped plant [default: alike on commissioned plants, none otherwise, each in `limits`]
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAME,...")]
    pub(super) weather: Vec<Weather>,
    /// Another plant than the shipped one, with its own weather
    #[arg(long, value_name = "PLANT.toml", conflicts_with = "weather")]
    pub(super) plant: Option<PathBuf>,
    /// Other diagnosers than the preset's: their configurations, in the order of the structure
    #[arg(long = "config", value_name = "MODULE.toml", requires = "plant")]
    #[serde(rename = "config")]
    pub(super) modules: Vec<PathBuf>,
    /// Seed of the campaign
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub(super) seed: u64,
    /// Mismatch of each plant against the nominal model [default: 0.1 for commissioned plants, 0 otherwise]
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = |x: &str| within(x, 0.0..=0.9))]
    pub(super) mismatch: Option<f64>,
    /// Controllers, which plants have in turn
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "shipped",
        value_name = "NAME,...",
        value_parser = named(ControllerTuning::ALL, ControllerTuning::as_str)
    )]
    pub(super) controllers: Vec<ControllerTuning>,
}

/// How many cases run at a time.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(crate) struct JobsArguments {
    /// Runs at a time; by default as many as there are processors
    #[arg(long, value_name = "J")]
    jobs: Option<NonZeroUsize>,
}

impl JobsArguments {
    /// Runs at a time.
    pub(crate) fn count(self) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        self.jobs.map_or(processors, NonZeroUsize::get)
    }
}

/// What becomes of a campaign, without an effect on its figures.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct EngineArguments {
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Run one case only, and explain what happens in it
    #[arg(long, value_name = "K", conflicts_with_all = ["json", "out"])]
    pub(super) show: Option<u64>,
    /// Run part K of N of the cases only, K from 0 to N-1; `trusswatch study merge` puts the parts together
    #[arg(long, value_name = "K/N", requires = "out", conflicts_with_all = ["json", "show"])]
    pub(super) shard: Option<Shard>,
    #[command(flatten)]
    pub(super) output: OutputArguments,
}

/// Where results go.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct OutputArguments {
    /// Keep everything in this directory: completed cases (from which the same command resumes), summary, tables, figures,
    /// and a report to look at
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Print one JSON object instead of tables
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) width: WidthArguments,
}

/// Runs with one fault, and runs without any.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct ScenarioArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub(super) system: SystemArguments,
    /// Runs with a fault
    #[arg(long, default_value_t = 300, value_name = "N")]
    pub(super) scenarios: u64,
    /// Runs without a fault
    #[arg(long, default_value_t = 0, value_name = "M")]
    pub(super) nominal: u64,
    /// Length of a run without a fault [s]
    #[arg(long, default_value = "15", value_name = "T", value_parser = |x: &str| within(x, 1e-3..=LONGEST_S))]
    pub(super) nominal_seconds: f64,
}

/// Give each run one fault: isolation, delays, false alarms, the paper's table
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct RunArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub(super) of: ScenarioArguments,
    #[command(flatten)]
    #[serde(skip)]
    pub(super) engine: EngineArguments,
}

/// Go through faults that hide, and through random histories
///
/// Hidden faults are there from the start, begin in gaps, creep, or follow other faults. They are given to so many plants,
/// each commissioned in its weather like by `trusswatch commission`: 40 snippets of 12 s, or more if its modules have more
/// than one peer, and two strokes of 100 kN of each cylinder. Case N is one of plant N/cases. In histories faults come, go,
/// come again and overlap, samples are lost and diagnosers restarted; each has a plant of its own, without a reference. A
/// healthy component that is named is a defect of the diagnosis: the command then fails, and says how to look at that case.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct ConditionArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub(super) system: SystemArguments,
    /// What is wrong: all situations with hidden faults in turn, all histories in turn, or one situation
    #[arg(long, default_value = HIDDEN, value_name = "NAME", value_parser = situations())]
    pub(super) situations: String,
    /// How many plants are commissioned
    #[arg(long, default_value = "3", value_name = "N")]
    pub(super) plants: NonZeroU64,
    /// Cases of each plant; of histories, all
    #[arg(long, default_value = "140", value_name = "N")]
    pub(super) cases: NonZeroU64,
    /// Every hidden fault that may be one is a bias of this size, either way, the gages taking turns; drifts are followed
    /// so far
    #[arg(long, value_name = "X", allow_hyphen_values = true, value_parser = |x: &str| within(x, 0.1..=1e4))]
    pub(super) bias_microstrain: Option<f64>,
    /// Every hidden fault that may be one is a leak of this coefficient, kinds of leak and cylinders taking turns
    #[arg(long, value_name = "X", conflicts_with = "bias_microstrain", value_parser = |x: &str| within(x, 1e-12..=1e-4))]
    pub(super) leak_area_m2: Option<f64>,
    /// Length of a case in which nothing is wrong [s]; e.g. 600 with `--situations healthy` for many hours
    #[arg(long, value_name = "S", value_parser = |x: &str| within(x, 1.0..=86_400.0))]
    pub(super) healthy_seconds: Option<f64>,
    /// Let every module work without its peers: its reference knows the module alone, so it reports the
    /// effects of another module's fault as its own; that does not count as a defect here
    #[arg(long)]
    pub(super) alone: bool,
    #[command(flatten)]
    #[serde(skip)]
    pub(super) engine: EngineArguments,
}

/// Measure the smallest fault that each detector finds within a time, by weather
///
/// Draws so many plants in each weather, each commissioned in it like by `trusswatch study conditions`, and gives them biases
/// and leaks of growing size: to the change detector ones that jump in, to the comparison with a reference ones that
/// are there from the first sample on. Gages, cylinders and plants take turns.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct LimitArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub(super) system: SystemArguments,
    /// Measure the minimum isolable fault instead: how likely a component is named within a second, by the size of its
    /// fault in units of the noise, on plants of their own without a reference
    #[arg(long)]
    pub(super) isolation: bool,
    /// How many plants are commissioned in each weather
    #[arg(long, default_value = "3", value_name = "N")]
    pub(super) plants: NonZeroU64,
    /// Runs for each size, detector and weather, shared among the plants
    #[arg(long, default_value = "30", value_name = "N")]
    pub(super) runs: NonZeroU64,
    #[command(flatten)]
    #[serde(skip)]
    pub(super) engine: EngineArguments,
}

/// Identify faults of every kind: is their kind right, and is their size within what is said?
///
/// Draws so many plants, each commissioned in the weather like by `trusswatch study conditions`, and gives each of them
/// so many faults, kinds and situations taking turns: alone, right after another one's effects, during a hard-over, as
/// the second one. Sizes are drawn from half the smallest that is found on. Case N is one of plant N/cases.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct IdentifyArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub(super) system: SystemArguments,
    /// How many plants are commissioned
    #[arg(long, default_value = "3", value_name = "N")]
    pub(super) plants: NonZeroU64,
    /// Faults of each plant
    #[arg(long, default_value = "130", value_name = "N")]
    pub(super) cases: NonZeroU64,
    /// Only faults of this kind
    #[arg(long, value_name = "NAME", value_parser = named(FaultKind::ALL, FaultKind::as_str))]
    pub(super) kind: Option<FaultKind>,
    /// The diagnosers do not know this kind: of its faults it is right to say that they are of none of the known kinds
    #[arg(long, value_name = "NAME", value_parser = named(FaultKind::ALL, FaultKind::as_str))]
    pub(super) without: Option<FaultKind>,
    /// Only faults in this situation
    #[arg(long, value_name = "NAME", value_parser = named(Situation::IDENTIFIED, Situation::as_str))]
    pub(super) situation: Option<Situation>,
    /// Size of every fault that has one, in limits of its kind: the smallest that is found within about two seconds
    #[arg(long, value_name = "X", value_parser = |x: &str| within(x, 0.01..=1000.0))]
    pub(super) in_limits: Option<f64>,
    #[command(flatten)]
    #[serde(skip)]
    pub(super) engine: EngineArguments,
}

/// Measure what faults cost the structure, and what can be done about it
///
/// Draws so many plants, each commissioned in the weather like by `trusswatch study conditions`, and gives each of them
/// so many faults, kinds and situations taking turns: alone, during a hard-over, from the start. Each is run with nothing
/// done about it; of a gage, with corrected readings given to the controller, with its innovations limited, and with both;
/// of a cylinder, if it is hard over, with the others making up for it, with its being shut off, and with both; and the
/// plant without the fault, by which the others are divided. Case N is one of plant N/cases.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct ToleranceArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub(super) system: SystemArguments,
    /// How many plants are commissioned
    #[arg(long, default_value = "3", value_name = "N")]
    pub(super) plants: NonZeroU64,
    /// Faults of each plant
    #[arg(long, default_value = "40", value_name = "N")]
    pub(super) cases: NonZeroU64,
    /// Only faults of this kind
    #[arg(long, value_name = "NAME", value_parser = named(FaultKind::ALL, FaultKind::as_str))]
    pub(super) kind: Option<FaultKind>,
    /// Faults of cylinders in place of those of gages
    #[arg(long, conflicts_with = "kind")]
    pub(super) cylinders: bool,
    /// Only faults in this situation
    #[arg(long, value_name = "NAME", value_parser = named(ToleranceCampaign::SITUATIONS, Situation::as_str))]
    pub(super) situation: Option<Situation>,
    /// Nothing fails: healthy components are declared faulty
    #[arg(long, conflicts_with_all = ["kind", "situation"])]
    pub(super) wrong: bool,
    /// Modules do not hear each other's forces
    #[arg(long)]
    pub(super) silent_peers: bool,
    /// The share of the messages about gages and forces that is lost
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = |x: &str| within(x, 0.0..=1.0))]
    pub(super) lost: f64,
    /// A column of each plant has lost this share of its stiffness since the commissioning
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = |x: &str| within(x, 0.0..=0.9))]
    pub(super) softened: f64,
    /// What happens for so many seconds after the onset counts
    #[arg(long, value_name = "SECONDS", default_value_t = COUNTED_S, value_parser = |x: &str| within(x, 1.0..=3600.0))]
    pub(super) counted_s: f64,
    /// What is done about a fault is done so many seconds late
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = |x: &str| within(x, 0.0..=10.0))]
    pub(super) late_s: f64,
    #[command(flatten)]
    #[serde(skip)]
    pub(super) engine: EngineArguments,
}

/// Compare the divergence with other detectors at the same rate of false alarms
///
/// All detectors watch the same residuals of the same runs: faults of every kind, with sizes from a fifth of the smallest
/// that is isolated, and runs without a fault. Half of these set every detector's limit, in the other half its false
/// alarms are counted. The shipped diagnosers and the paper's have rows of their own, with their own thresholds.
#[derive(Debug, Clone, Args, Serialize, Deserialize)]
pub(super) struct RivalArguments {
    #[command(flatten)]
    #[serde(flatten)]
    pub(super) system: SystemArguments,
    /// Runs with a fault
    #[arg(long, default_value_t = 210, value_name = "N")]
    pub(super) scenarios: u64,
    /// Runs without a fault
    #[arg(long, default_value_t = 80, value_name = "M", value_parser = clap::value_parser!(u64).range(2..))]
    pub(super) nominal: u64,
    /// Length of a run without a fault [s]
    #[arg(long, default_value = "75", value_name = "T", value_parser = |x: &str| within(x, 1.0..=LONGEST_S))]
    pub(super) nominal_seconds: f64,
    /// False alarms of each detector per hour
    #[arg(long, default_value = "2", value_name = "RATE", value_parser = |x: &str| within(x, 0.0..=3600.0))]
    pub(super) per_hour: f64,
    #[command(flatten)]
    #[serde(skip)]
    pub(super) engine: EngineArguments,
}

/// Put the shards of a campaign together: the same output as of one run
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// Directories of shards (their `--out`), which together hold every case
    #[arg(value_name = "DIR", required = true)]
    pub(super) directories: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) output: OutputArguments,
}

/// Compare the four combinations of rule and actuator residual on the same scenarios
#[derive(Debug, Args)]
pub(super) struct CompareArguments {
    #[command(flatten)]
    pub(super) of: ScenarioArguments,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) width: WidthArguments,
}

/// Write the residuals of every run with the truth beside them, one CSV table a run, for other
/// detectors
#[derive(Debug, Args)]
pub(super) struct ExportArguments {
    /// The directory to write into
    #[arg(value_name = "DIR")]
    pub(super) directory: PathBuf,
    /// Write what was measured too: demands, pressures, elongations, from which `learn` and `detect
    /// --config` start
    #[arg(long)]
    pub(super) readings: bool,
    #[command(flatten)]
    pub(super) of: ScenarioArguments,
    #[command(flatten)]
    pub(super) jobs: JobsArguments,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
}

/// Reads a number within a range.
fn within(text: &str, range: RangeInclusive<f64>) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number| range.contains(number));
    number.ok_or_else(|| format!("use a number from {} to {}", range.start(), range.end()))
}

/// Reads one of these by its name.
fn named<T: Copy + Send + Sync + 'static>(
    all: impl Into<Vec<T>>,
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let all: Vec<T> = all.into();
    let names: Vec<&str> = all.iter().map(|one| name(*one)).collect();
    PossibleValuesParser::new(names).try_map(move |given| {
        all.iter().copied().find(|one| name(*one) == given).ok_or("no such name")
    })
}

/// Reads the name of a set of situations or of one.
fn situations() -> PossibleValuesParser {
    let all = Situation::HIDDEN.into_iter().chain(Situation::HISTORIES);
    PossibleValuesParser::new([HIDDEN, HISTORIES].into_iter().chain(all.map(Situation::as_str)))
}
