//! `trusswatch calibrate`: thresholds from runs of the simulated plant without a fault.

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use daemon::config::{PlantConfig, PlantFlags, Uncalibrated, load_plant, load_uncalibrated};
use daemon::thresholds::{Provenance, Thresholds};
use indicatif::{ProgressBar, ProgressStyle};
use study::{Calibration, NominalRuns};
use truss::Module;

use crate::failure::Failure;

/// Make thresholds from runs without a fault: the largest divergence of each channel, times a margin
///
/// The modules' own configurations say which detection the thresholds are for and into which file they
/// are written. Each run has a plant of its own, with another wind and other loads, and differs from
/// what is believed of it by up to the mismatch.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Configurations of the diagnosers, one for each equipped module, in the order of the structure
    #[arg(required = true, value_name = "MODULE.toml")]
    modules: Vec<PathBuf>,
    /// Configuration of the plant
    #[arg(long, value_name = "FILE")]
    plant: PathBuf,
    /// Number of runs
    #[arg(long, default_value_t = 100, value_name = "N")]
    runs: u64,
    /// Length of a run, warm-up included [s]
    #[arg(long, default_value_t = 15.0, value_name = "T")]
    seconds: f64,
    /// Seed of the first run; the others follow one by one
    #[arg(long, default_value_t = 1_000_000, value_name = "SEED")]
    first_seed: u64,
    /// Factor on the largest divergence
    #[arg(long, default_value_t = 2.5, value_name = "FACTOR")]
    margin: f64,
    /// By how much each run's plant differs from what is believed of it, e.g. 0.1
    #[arg(long, default_value_t = 0.1, value_name = "SHARE")]
    mismatch: f64,
    /// Runs at a time; by default as many as there are processors
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check(arguments)?;
    let plant = load_plant(&arguments.plant, &PlantFlags::default())
        .map_err(|errors| inputs(&errors.to_string()))?;
    let modules: Vec<Uncalibrated> = (arguments.modules.iter())
        .map(|file| load_uncalibrated(file).map_err(|errors| inputs(&errors.to_string())))
        .collect::<Result<_, _>>()?;
    let step_s = plant.parameters.step_s;
    let steps = (arguments.seconds / step_s).round() as u64;
    let calibration = calibrate(arguments, &plant, &modules, steps)?;
    if calibration.watched_steps == 0 {
        let message = format!(
            "a run of {} s ends before every channel is watched; use longer runs",
            arguments.seconds
        );
        return Err(Failure::usage(message));
    }
    let hours = calibration.watched_steps as f64 * step_s / 3600.0;
    for (module, largest) in modules.iter().zip(&calibration.largest) {
        let thresholds = thresholds(arguments, module, largest, hours);
        write_file(&module.thresholds, &thresholds)?;
        say(&format!("{}: {} thresholds", module.thresholds.display(), largest.len()))?;
    }
    Ok(())
}

fn check(arguments: &Arguments) -> Result<(), Failure> {
    let refuse = |flag: &str, value: String, use_instead: &str| {
        Err(Failure::usage(format!("`{flag}` is {value}; use {use_instead}")))
    };
    if !(arguments.margin.is_finite() && arguments.margin > 0.0) {
        return refuse("--margin", arguments.margin.to_string(), "a finite number above 0");
    }
    if !(arguments.seconds > 0.0 && arguments.seconds <= 86_400.0) {
        return refuse("--seconds", arguments.seconds.to_string(), "above 0 and up to a day");
    }
    if arguments.runs == 0 {
        return refuse("--runs", "0".into(), "at least 1");
    }
    Ok(())
}

fn calibrate(
    arguments: &Arguments,
    plant: &PlantConfig,
    modules: &[Uncalibrated],
    steps: u64,
) -> Result<Calibration, Failure> {
    let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let runs = NominalRuns {
        first_seed: arguments.first_seed,
        runs: arguments.runs,
        steps,
        mismatch: arguments.mismatch,
        jobs: arguments.jobs.map_or(processors, NonZeroUsize::get),
    };
    let setups: Vec<_> = modules.iter().map(|module| module.setup.clone()).collect();
    let bar = progress_bar(arguments.runs);
    let calibration = runs.calibrate(&plant.structure, &plant.parameters, &setups, &|| bar.inc(1));
    bar.finish_and_clear();
    calibration.map_err(|error| Failure::input(error.to_string()))
}

fn progress_bar(runs: u64) -> ProgressBar {
    let template = "{wide_bar} {pos} of {len} runs, {eta} left";
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(runs).with_style(style)
}

fn thresholds(
    arguments: &Arguments,
    module: &Uncalibrated,
    largest: &[f64],
    hours: f64,
) -> Thresholds {
    let last_seed = arguments.first_seed.saturating_add(arguments.runs - 1);
    let own = module.setup.structure.module(&module.setup.module);
    Thresholds {
        module: module.setup.module.clone(),
        provenance: Provenance {
            method: "largest divergence of runs without a fault, times the margin".into(),
            seeds: format!("{}..={last_seed}", arguments.first_seed),
            runs: arguments.runs,
            hours: round(hours),
            margin: arguments.margin,
            mismatch: (arguments.mismatch > 0.0).then_some(arguments.mismatch),
            false_alarms_per_hour: None,
            note: None,
        },
        detection: module.detection,
        thresholds: own
            .into_iter()
            .flat_map(Module::components)
            .zip(largest.iter().map(|d| round(d * arguments.margin)))
            .collect(),
    }
}

/// Four digits are plenty for a threshold, and pleasant to read.
fn round(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

fn write_file(file: &Path, thresholds: &Thresholds) -> Result<(), Failure> {
    let text = toml::to_string(thresholds).map_err(|error| Failure::runtime(error.to_string()))?;
    std::fs::write(file, text)
        .map_err(|error| Failure::runtime(format!("cannot write {}: {error}", file.display())))
}

fn say(line: &str) -> Result<(), Failure> {
    writeln!(io::stdout(), "{line}").map_err(|error| Failure::runtime(error.to_string()))
}

fn inputs(errors: &str) -> Failure {
    Failure::inputs(errors.lines().map(str::to_string).collect())
}
