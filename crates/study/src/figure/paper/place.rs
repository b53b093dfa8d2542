//! Components by their position, as numbered in the paper, e.g. the third actuator of the first module; and the sizes
//! of the figures' faults. The paper does not state sizes, so they are in the middle of the campaign's ranges for
//! scenarios.

use truss::{Module, Structure};
use vocabulary::{Component, ComponentPath, fault::Fault};

use crate::error::StudyError;
use crate::scenarios::ScenarioCampaign;

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

fn middle([from, to]: [f64; 2]) -> f64 {
    0.5 * (from + to)
}

/// A bias of a gage of this length.
pub(super) fn bias(campaign: &ScenarioCampaign, length_m: f64) -> Fault {
    Fault::Bias { offset_m: length_m * middle(campaign.ranges.bias_strain) }
}

/// A random walk of a gage of this length. The middle of its range of drifts is zero, so it has the largest drift.
pub(super) fn random_walk(campaign: &ScenarioCampaign, length_m: f64) -> Fault {
    let ranges = &campaign.ranges;
    let per_ms = (campaign.system.parameters.step_s / 1e-3).sqrt();
    Fault::RandomWalk {
        drift_m_per_s: length_m * ranges.drift_strain_per_s[1],
        increment_m: length_m * middle(ranges.increment_strain) * per_ms,
    }
}

/// A leak of chamber A to the environment.
pub(super) fn external_leakage_a(campaign: &ScenarioCampaign) -> Fault {
    Fault::ExternalLeakageA { area_m2: middle(campaign.ranges.leak_area_m2) }
}
