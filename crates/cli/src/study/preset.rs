//! Which diagnosers on which plant: the shipped ones, the paper's, or the user's own.

use std::path::{Path, PathBuf};

use daemon::config::{ConfigErrors, PlantFlags, load_diagnoser, load_plant};
use study::{Campaign, ScenarioRanges};

use super::arguments::{Arguments, PresetName};
use crate::failure::Failure;
use crate::shipped::{MODULES, OTHERS, PAPER_MODULES, PLANT, temporary_directory};

/// The longest run without a fault \[s\]: a year.
const LONGEST_S: f64 = 365.0 * 86_400.0;

/// Name of the preset, for people and files.
pub(super) fn name(arguments: &Arguments) -> &'static str {
    match (&arguments.plant, arguments.preset) {
        (Some(_), _) => "own",
        (None, PresetName::Paper) => "paper",
        (None, PresetName::Default) => "default",
    }
}

/// The campaign that the arguments ask for.
pub(super) fn campaign(arguments: &Arguments) -> Result<Campaign, Failure> {
    if !(0.0..1.0).contains(&arguments.mismatch) {
        let mismatch = arguments.mismatch;
        let message =
            format!("`--mismatch` is {mismatch}; use a share from 0 to below 1, e.g. 0.1");
        return Err(Failure::usage(message));
    }
    if !(arguments.nominal_seconds > 0.0 && arguments.nominal_seconds <= LONGEST_S) {
        let message = format!(
            "`--nominal-seconds` is {}; use a length above 0 and up to {LONGEST_S}",
            arguments.nominal_seconds
        );
        return Err(Failure::usage(message));
    }
    match &arguments.plant {
        Some(plant) => load(arguments, plant, &arguments.modules),
        None => shipped(arguments),
    }
}

fn shipped(arguments: &Arguments) -> Result<Campaign, Failure> {
    let directory = temporary_directory("trusswatch-study-")?;
    for file in OTHERS {
        file.write(directory.path())?;
    }
    let modules = match arguments.preset {
        PresetName::Paper => PAPER_MODULES,
        PresetName::Default => MODULES,
    };
    let modules: Vec<PathBuf> =
        modules.iter().map(|file| file.write(directory.path())).collect::<Result<_, _>>()?;
    load(arguments, &PLANT.write(directory.path())?, &modules)
}

fn load(arguments: &Arguments, plant: &Path, modules: &[PathBuf]) -> Result<Campaign, Failure> {
    let plant = load_plant(plant, &PlantFlags::default()).map_err(|errors| unusable(&errors))?;
    let mut setups = Vec::new();
    for module in modules {
        let config = load_diagnoser(module).map_err(|errors| unusable(&errors))?;
        setups.push(config.module_setup());
    }
    Ok(Campaign {
        structure: plant.structure,
        parameters: plant.parameters,
        setups,
        mismatch: arguments.mismatch,
        seed: arguments.seed,
        ranges: ScenarioRanges {
            nominal_s: arguments.nominal_seconds,
            ..ScenarioRanges::default()
        },
    })
}

fn unusable(errors: &ConfigErrors) -> Failure {
    Failure::inputs(errors.0.iter().map(ToString::to_string).collect())
}
