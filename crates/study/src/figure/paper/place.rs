//! Components by their position, as the paper counts them: third actuator of the first module.

use truss::{Module, Structure};
use vocabulary::{Component, ComponentPath};

use crate::error::StudyError;

/// Equipped module number `number`, counted from 1.
pub(super) fn module(structure: &Structure, number: usize) -> Result<&Module, StudyError> {
    let module = structure.equipped().nth(number.saturating_sub(1));
    module.ok_or_else(|| lacks(structure, &format!("equipped module {number}")))
}

/// An actuator, module and actuator counted from 1.
pub(super) fn actuator(
    structure: &Structure,
    number: usize,
    actuator: usize,
) -> Result<ComponentPath, StudyError> {
    let module = module(structure, number)?;
    let found = module.actuators.get(actuator.saturating_sub(1));
    let what = || format!("actuator {actuator} of equipped module {number}");
    let name = &found.ok_or_else(|| lacks(structure, &what()))?.name;
    let component = Component::Actuator(name.clone());
    Ok(ComponentPath { module: module.name.clone(), component })
}

/// A gage and its length \[m\], module and gage counted from 1.
pub(super) fn gage(
    structure: &Structure,
    number: usize,
    gage: usize,
) -> Result<(ComponentPath, f64), StudyError> {
    let module = module(structure, number)?;
    let found = module.gages.get(gage.saturating_sub(1));
    let what = || format!("gage {gage} of equipped module {number}");
    let gage = found.ok_or_else(|| lacks(structure, &what()))?;
    let component = Component::Sensor(gage.name.clone());
    let path = ComponentPath { module: module.name.clone(), component };
    Ok((path, structure.gage_length_m(gage)))
}

fn lacks(structure: &Structure, what: &str) -> StudyError {
    StudyError::Lacks { structure: structure.name.clone(), what: what.to_owned() }
}
