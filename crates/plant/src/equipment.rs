//! The channels of a structure: truth and belief must have the same.

use truss::Structure;

use crate::error::PlantError;

/// Both structures must have the same channels.
pub(crate) fn check_equipment(truth: &Structure, believed: &Structure) -> Result<(), PlantError> {
    let channels = |structure: &Structure| -> Vec<String> {
        let mut names = Vec::new();
        for module in &structure.modules {
            let actuators = module.actuators.iter().map(|actuator| actuator.name.to_string());
            let gages = module.gages.iter().map(|gage| gage.name.to_string());
            names.extend(actuators.chain(gages).map(|name| format!("{}/{name}", module.name)));
        }
        names
    };
    let (truth, believed) = (channels(truth), channels(believed));
    if truth == believed {
        return Ok(());
    }
    let named = |names: &[String], other: &[String]| -> Vec<String> {
        names.iter().filter(|name| !other.contains(name)).map(|name| format!("`{name}`")).collect()
    };
    let mut different = named(&truth, &believed);
    different.extend(named(&believed, &truth));
    let different =
        if different.is_empty() { "their order".to_owned() } else { different.join(", ") };
    Err(PlantError::Equipment(different))
}
