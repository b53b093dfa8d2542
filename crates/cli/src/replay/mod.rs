//! `trusswatch replay`: recorded samples through the same diagnosers once more.

mod exact;
mod other_settings;
mod publish;
mod reading;
mod report;

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use daemon::config::load_diagnoser;
use vocabulary::ModuleName;

use crate::export::write_corrected;
use crate::failure::Failure;
use crate::output;
use crate::table::WidthArguments;
pub(crate) use reading::read;

/// Replay a recording through the same diagnosers at full speed
///
/// Several files are one recording. Each module's diagnoser gets what it got then, its samples, its peers' answers and
/// what operators commanded, and comes to the same verdicts, bit for bit. With other settings, the modules query each
/// other anew, and a table shows what was named and what would have been.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recordings, made by `trusswatch record`
    #[arg(required = true, value_name = "FILE.mcap")]
    files: Vec<PathBuf>,
    /// Compare verdicts, divergences and identifications with the recorded ones; the exit code is 1 if they differ, and 6 if
    /// not all of them could be compared. Each file of a longer recording can be compared by itself
    #[arg(long)]
    verify: bool,
    /// Only these modules
    #[arg(long = "module", value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    modules: Vec<ModuleName>,
    /// Write what each gage reads at every step, or should have read from the verdict on it on, to tables in this directory,
    /// as `trusswatch export --corrected` does
    #[arg(long, value_name = "DIR", conflicts_with_all = ["publish", "SettingsArguments"])]
    corrected: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    settings: SettingsArguments,
    #[command(flatten)]
    publish: publish::PublishArguments,
    #[command(flatten)]
    width: WidthArguments,
}

/// Other settings than the recorded ones.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "What would have been named if")]
struct SettingsArguments {
    /// Configurations of diagnosers instead of the recorded ones
    #[arg(long, value_name = "MODULE.toml", num_args = 1.., conflicts_with = "verify")]
    config: Vec<PathBuf>,
    /// Factor on every threshold of a divergence; the comparison with a reference stays as it is
    #[arg(long, value_name = "FACTOR", conflicts_with = "verify", allow_hyphen_values = true)]
    threshold_factor: Option<f64>,
    /// Rule of isolation
    #[arg(long, value_enum, value_name = "RULE", conflicts_with = "verify")]
    rule: Option<RuleName>,
    /// By which residual actuators are watched; other thresholds belong to it
    #[arg(long, value_enum, value_name = "RESIDUAL", conflicts_with = "verify")]
    residual: Option<ResidualName>,
}

/// A rule of isolation by its name in configurations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum RuleName {
    /// The first change in the structure names the fault and explains the later ones
    FirstChange,
    /// Only actuator faults explain, without a time limit
    Paper,
}

/// A residual of actuators by its name in configurations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum ResidualName {
    /// Force of a nominal force loop minus observed force
    Tracking,
    /// Demand minus observed force
    Demand,
}

impl SettingsArguments {
    fn settings(&self) -> Result<::replay::ReplaySettings, Failure> {
        if let Some(factor) = self.threshold_factor.filter(|f| !(f.is_finite() && *f > 0.0)) {
            let problem = format!("`--threshold-factor` is {factor}; use a finite number above 0");
            return Err(Failure::usage(problem));
        }
        let mut settings = ::replay::ReplaySettings {
            threshold_factor: self.threshold_factor,
            rule: self.rule.map(|rule| match rule {
                RuleName::FirstChange => diagnosis::Rule::FirstChange,
                RuleName::Paper => diagnosis::Rule::Paper,
            }),
            residual: self.residual.map(|residual| match residual {
                ResidualName::Tracking => diagnosis::residual::ActuatorResidual::Tracking,
                ResidualName::Demand => diagnosis::residual::ActuatorResidual::Demand,
            }),
            ..::replay::ReplaySettings::default()
        };
        for file in &self.config {
            let config = load_diagnoser(file).map_err(|errors| {
                Failure::inputs(errors.0.iter().map(ToString::to_string).collect())
            })?;
            let setup = config.module_setup();
            let module = setup.module.clone();
            if settings.setups.insert(module.clone(), setup).is_some() {
                let problem = format!("`--config` has `{module}` twice; give each module once");
                return Err(Failure::usage(problem));
            }
        }
        Ok(settings)
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let settings = arguments.settings.settings()?;
    let began = Instant::now();
    let mut reading = read(&arguments.files, &arguments.modules)?;
    if arguments.publish.is_wanted() {
        arguments.publish.publish(&reading)?;
        return reading.complete();
    }
    let mut out = output::stdout();
    let width = arguments.width.limit();
    if settings.is_any() {
        let comparison = other_settings::run(&mut reading, &settings)?;
        write!(out, "{}", comparison.written(arguments.json, width)?)?;
        out.flush()?;
        reading.complete()?;
        return comparison.complete();
    }
    let replayed = exact::run(&reading, began);
    write!(out, "{}", replayed.written(arguments.verify, arguments.json, width)?)?;
    out.flush()?;
    replayed.outcome(arguments.verify)?;
    let is_complete = reading.complete();
    if let Some(directory) = &arguments.corrected {
        write_corrected(directory, reading.records)?;
    }
    is_complete?;
    if arguments.verify { replayed.complete() } else { Ok(()) }
}
