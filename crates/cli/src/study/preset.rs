//! Which diagnosers on which plant: the shipped ones, the paper's, or the user's own.

use std::path::{Path, PathBuf};

use daemon::config::{PlantConfig, PlantFlags, load_diagnoser, load_plant};
use diagnosis::ModuleSetup;
use settings::ConfigErrors;
use study::{Campaign, ScenarioRanges};

use super::arguments::{CampaignArguments, CommonArguments, PresetName};
use crate::failure::Failure;
use crate::shipped::{MODULES, OTHERS, PAPER_MODULES, PLANT, Shipped, temporary_directory};

/// The longest run without a fault \[s\]: a year.
const LONGEST_S: f64 = 365.0 * 86_400.0;

/// Name of the preset, for people and files.
pub(super) fn name(arguments: &CampaignArguments) -> &'static str {
    match (&arguments.plant, arguments.preset) {
        (Some(_), _) => "own",
        (None, PresetName::Paper) => "paper",
        (None, PresetName::Default) => "default",
    }
}

/// The campaign that the arguments ask for.
pub(super) fn campaign(arguments: &CampaignArguments) -> Result<Campaign, Failure> {
    if !(0.0..1.0).contains(&arguments.mismatch) {
        let mismatch = arguments.mismatch;
        let message =
            format!("`--mismatch` is {mismatch}; use a share from 0 to below 1, e.g. 0.1");
        return Err(Failure::usage(message));
    }
    match &arguments.plant {
        Some(plant) => load(arguments, plant, &arguments.modules),
        None => shipped(arguments),
    }
}

/// Can plants be drawn that differ so much from the nominal model?
pub(super) fn check_drawn(mismatch: f64) -> Result<(), Failure> {
    if (0.0..=0.9).contains(&mismatch) {
        return Ok(());
    }
    let problem = format!("`--mismatch` is {mismatch}; use a share from 0 to 0.9");
    Err(Failure::usage(problem))
}

/// The same campaign with nominal runs of the length asked for.
pub(super) fn with_runs(arguments: &CommonArguments) -> Result<Campaign, Failure> {
    let nominal_s = arguments.runs.nominal_seconds;
    if !(nominal_s > 0.0 && nominal_s <= LONGEST_S) {
        let message = format!(
            "`--nominal-seconds` is {nominal_s}; use a length above 0 and up to {LONGEST_S}"
        );
        return Err(Failure::usage(message));
    }
    let mut campaign = campaign(&arguments.campaign)?;
    campaign.ranges.nominal_s = nominal_s;
    Ok(campaign)
}

fn shipped(arguments: &CampaignArguments) -> Result<Campaign, Failure> {
    let modules = match arguments.preset {
        PresetName::Paper => PAPER_MODULES,
        PresetName::Default => MODULES,
    };
    with_shipped(PLANT, modules, |plant, modules| load(arguments, plant, modules))
}

/// Lays out shipped files in a directory of their own for as long as `take` needs.
pub(super) fn with_shipped<T>(
    plant: Shipped,
    modules: [Shipped; 2],
    take: impl FnOnce(&Path, &[PathBuf]) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let directory = temporary_directory("trusswatch-study-")?;
    for file in OTHERS {
        file.write(directory.path())?;
    }
    let modules: Vec<PathBuf> =
        modules.iter().map(|file| file.write(directory.path())).collect::<Result<_, _>>()?;
    take(&plant.write(directory.path())?, &modules)
}

/// Reads a plant and its diagnosers.
pub(super) fn read(
    plant: &Path,
    modules: &[PathBuf],
) -> Result<(PlantConfig, Vec<ModuleSetup>), Failure> {
    let plant = load_plant(plant, &PlantFlags::default()).map_err(|errors| unusable(&errors))?;
    let mut setups = Vec::new();
    for module in modules {
        let config = load_diagnoser(module).map_err(|errors| unusable(&errors))?;
        // Each run draws a plant of its own, of which no reference is known.
        setups.push(ModuleSetup { reference: None, ..config.module_setup() });
    }
    Ok((plant, setups))
}

fn load(
    arguments: &CampaignArguments,
    plant: &Path,
    modules: &[PathBuf],
) -> Result<Campaign, Failure> {
    let (plant, setups) = read(plant, modules)?;
    Ok(Campaign {
        structure: plant.structure,
        parameters: plant.parameters,
        setups,
        mismatch: arguments.mismatch,
        controllers: arguments.controllers.iter().map(|name| (*name).into()).collect(),
        seed: arguments.seed,
        ranges: ScenarioRanges::default(),
    })
}

fn unusable(errors: &ConfigErrors) -> Failure {
    Failure::inputs(errors.0.iter().map(ToString::to_string).collect())
}
