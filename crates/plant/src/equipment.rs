//! The channels of a structure: the true and the nominal one must have the same.

use truss::Structure;

use crate::error::PlantError;

/// Both structures must have the same channels.
pub(crate) fn check_equipment(truth: &Structure, nominal: &Structure) -> Result<(), PlantError> {
    let channels = |structure: &Structure| -> Vec<String> {
        let mut names = Vec::new();
        for module in &structure.modules {
            let actuators = module.actuators.iter().map(|actuator| actuator.name.to_string());
            let gages = module.gages.iter().map(|gage| gage.name.to_string());
            names.extend(actuators.chain(gages).map(|name| format!("{}/{name}", module.name)));
        }
        names
    };
    let (truth, nominal) = (channels(truth), channels(nominal));
    if truth == nominal {
        return Ok(());
    }
    let named = |names: &[String], other: &[String]| -> Vec<String> {
        names.iter().filter(|name| !other.contains(name)).map(|name| format!("`{name}`")).collect()
    };
    let mut different = named(&truth, &nominal);
    different.extend(named(&nominal, &truth));
    let different =
        if different.is_empty() { "their order".to_owned() } else { different.join(", ") };
    Err(PlantError::Equipment(different))
}
