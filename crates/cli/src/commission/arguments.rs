//! What `trusswatch commission` takes, and what of it cannot be meant.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use study::commissioning::FALSE_ALARMS_PER_HOUR;

use crate::failure::Failure;
use tables::TableFlags;

/// How long a snippet may be \[s\]: what a stroke may take.
const SECONDS: [f64; 2] = [2.0, 600.0];

const EXAMPLES: &str = "\
Examples:
  trusswatch commission configs/module1.toml configs/module2.toml --plant configs/plant.toml --out references
  trusswatch commission configs/module1.toml configs/module2.toml --plant configs/plant.toml \\
      --seed 2000 --add references/snippets.jsonl --out references
  trusswatch commission module1.toml module2.toml --recording monday --recording tuesday … --out references

A module uses its reference once its configuration names it: reference = \"references/module1.toml\".";

/// Learn references from healthy modules, against which diagnosers judge health
///
/// A reference is learnt from snippets: some seconds of all modules at a time, each under other weather and other
/// loads, and while the cylinders move. What it was not taught under it cannot judge. Snippets are simulated: so many
/// under the plant's weather, and two for each cylinder in which it pushes and pulls. Or they are recorded: each is one
/// run, a file of `trusswatch record` (MCAP), a directory of such files, or a directory with a table (CSV) of samples for
/// each module, `module1.csv` or, as `trusswatch export` calls it, `module1-run-7.csv`. Such a table has a header row and
/// columns named `module1/actuator/a1/demand_n`, `module1/actuator/a1/pressure_a_pa`,
/// `module1/actuator/a1/pressure_b_pa` and `module1/sensor/g1/elongation_m` (the module's name may be left out), and
/// possibly one of steps or times; each row is one step, the same in all tables. A signal has no value where its cell is
/// empty. The first 2.5 seconds of a recording are not used.
///
/// Writes the reference of each module and `snippets.jsonl`, to which later ones can be added.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Configurations of the diagnosers, one for each equipped module
    #[arg(required = true, value_name = "MODULE.toml")]
    pub(super) modules: Vec<PathBuf>,
    /// A recorded snippet instead of simulated ones, a directory or a file (MCAP); as often as there are
    #[arg(
        long = "recording",
        value_name = "DIR|FILE.mcap",
        conflicts_with_all = [
            "plant", "snippets", "seconds", "stroke_n", "seed", "mismatch", "plant_seed", "jobs"
        ]
    )]
    pub(super) recordings: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) table: TableFlags,
    /// Earlier snippets, which are used and kept as well: `snippets.jsonl` of an earlier commissioning
    #[arg(long, value_name = "FILE")]
    pub(super) add: Vec<PathBuf>,
    /// Directory that references and snippets are written into
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Rate of false alarms of a module that the thresholds are for, at most and with 95 % confidence [1/h]
    #[arg(long, default_value_t = FALSE_ALARMS_PER_HOUR, value_name = "R", allow_hyphen_values = true)]
    pub(super) false_alarms_per_hour: f64,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) simulation: SnippetFlags,
}

/// Which snippets are simulated.
#[derive(Debug, clap::Args)]
pub(super) struct SnippetFlags {
    /// Configuration of the plant
    #[arg(
        long,
        value_name = "PLANT.toml",
        required_unless_present_any = ["recordings", "add"],
        conflicts_with = "TableFlags"
    )]
    pub(super) plant: Option<PathBuf>,
    /// Snippets under changing weather, beside two strokes of each cylinder
    #[arg(long, default_value_t = 40, value_name = "N")]
    pub(super) snippets: u64,
    /// Length of a snippet and of a stroke [s]
    #[arg(long, default_value_t = 12.0, value_name = "T", allow_hyphen_values = true)]
    pub(super) seconds: f64,
    /// Largest change of a cylinder's demand in its stroke, both ways [N]
    #[arg(long, default_value_t = 100e3, value_name = "F", allow_hyphen_values = true)]
    pub(super) stroke_n: f64,
    /// Seed of the first snippet; the others follow one by one
    #[arg(long, default_value_t = 1000, value_name = "SEED")]
    pub(super) seed: u64,
    /// Mismatch of the plant against the nominal model, e.g. 0.1 [default: as the plant's file has it]
    #[arg(long, value_name = "SHARE", requires = "plant_seed", allow_hyphen_values = true)]
    pub(super) mismatch: Option<f64>,
    /// Which plant within the mismatch
    #[arg(long, value_name = "SEED", requires = "mismatch")]
    pub(super) plant_seed: Option<u64>,
    /// Snippets at a time; by default as many as there are processors
    #[arg(long, value_name = "N")]
    pub(super) jobs: Option<NonZeroUsize>,
}

impl Arguments {
    /// Checks the figures.
    pub(super) fn check(&self) -> Result<(), Failure> {
        let SnippetFlags { seconds, stroke_n, mismatch, .. } = &self.simulation;
        let [least, most] = SECONDS;
        if !(least..=most).contains(seconds) {
            let problem = format!("`--seconds` is {seconds}; use {least} to {most}");
            return Err(Failure::usage(problem));
        }
        if !(*stroke_n > 0.0 && stroke_n.is_finite()) {
            let problem = format!("`--stroke-n` is {stroke_n}; use a finite number above 0");
            return Err(Failure::usage(problem));
        }
        let rate = self.false_alarms_per_hour;
        if !(rate > 0.0 && rate.is_finite()) {
            let problem =
                format!("`--false-alarms-per-hour` is {rate}; use a finite number above 0");
            return Err(Failure::usage(problem));
        }
        match mismatch.filter(|mismatch| !(0.0..1.0).contains(mismatch)) {
            Some(mismatch) => Err(Failure::usage(format!(
                "`--mismatch` is {mismatch}; use a share from 0 to below 1, e.g. 0.1"
            ))),
            None => Ok(()),
        }
    }
}

impl SnippetFlags {
    /// Snippets at a time.
    pub(super) fn jobs(&self) -> usize {
        let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        self.jobs.map_or(processors, NonZeroUsize::get)
    }
}
