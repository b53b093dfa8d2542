//! The modules that are commissioned together.

use std::path::PathBuf;

use daemon::config::{PlantConfig, load_uncalibrated};
use diagnosis::ModuleSetup;
use vocabulary::ModuleName;

use crate::failure::Failure;

/// Reads the modules' configurations. Neither their thresholds nor a reference that they name matter. The modules of
/// a plant come in its order, others as they were given.
///
/// # Errors
/// A configuration with mistakes, a module twice or missing, or steps that differ.
pub(super) fn load(
    files: &[PathBuf],
    plant: Option<&PlantConfig>,
) -> Result<Vec<ModuleSetup>, Failure> {
    let mut setups: Vec<ModuleSetup> = Vec::new();
    for file in files {
        let setup = load_uncalibrated(file)?.setup;
        if setups.iter().any(|earlier| earlier.module == setup.module) {
            let problem = format!("`{}` is given twice; give each module once", setup.module);
            return Err(Failure::usage(format!("{}: {problem}", file.display())));
        }
        setups.push(setup);
    }
    check_steps(&setups, plant)?;
    if let Some(plant) = plant {
        setups = in_order_of(plant, setups)?;
    }
    check_peers(&setups)?;
    Ok(setups)
}

/// The windows of all modules must end at the same instants.
fn check_steps(setups: &[ModuleSetup], plant: Option<&PlantConfig>) -> Result<(), Failure> {
    let (whose, step_s) = match (plant, setups.first()) {
        (Some(plant), _) => ("the plant".to_owned(), plant.parameters.step_s),
        (None, Some(first)) => (format!("`{}`", first.module), first.step_s),
        (None, None) => return Ok(()),
    };
    let other = setups.iter().find(|setup| setup.step_s != step_s);
    other.map_or(Ok(()), |setup| {
        Err(Failure::input(format!(
            "`{}` has steps of {} s, {whose} of {step_s} s; give them the same",
            setup.module, setup.step_s
        )))
    })
}

fn in_order_of(plant: &PlantConfig, setups: Vec<ModuleSetup>) -> Result<Vec<ModuleSetup>, Failure> {
    let equipped: Vec<&ModuleName> =
        plant.structure.equipped().map(|module| &module.name).collect();
    let place = |setup: &ModuleSetup| equipped.iter().position(|name| **name == setup.module);
    if let Some(unknown) = setups.iter().find(|setup| place(setup).is_none()) {
        let known: Vec<String> = equipped.iter().map(|name| format!("`{name}`")).collect();
        return Err(Failure::input(format!(
            "`{}` is not an equipped module of the plant; these are {}",
            unknown.module,
            known.join(", ")
        )));
    }
    let is_there = |name: &ModuleName| setups.iter().any(|setup| setup.module == *name);
    if let Some(missing) = equipped.iter().find(|name| !is_there(name)) {
        return Err(Failure::usage(format!(
            "the plant has module `{missing}` too; give its configuration as well"
        )));
    }
    let mut setups = setups;
    setups.sort_by_key(place);
    Ok(setups)
}

/// A reference knows the module's peers: they have to be there.
fn check_peers(setups: &[ModuleSetup]) -> Result<(), Failure> {
    for setup in setups {
        let is_there = |peer: &ModuleName| setups.iter().any(|setup| setup.module == *peer);
        if let Some(missing) = setup.peers.iter().find(|peer| !is_there(peer)) {
            return Err(Failure::usage(format!(
                "`{}` has the peer `{missing}`; give its configuration as well",
                setup.module
            )));
        }
    }
    Ok(())
}
