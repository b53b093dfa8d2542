//! The setup of a diagnoser, as a message and back.

use crate::ModuleSetup;
use crate::state::fingerprint;

use super::Speaker;

impl Speaker {
    /// The message with the setup of its diagnoser, by a version of the software, with the fingerprint of its thresholds.
    ///
    /// # Errors
    /// A setup that JSON has no form for; none that a diagnoser can be made of is.
    pub fn configuration(
        &self,
        setup: &ModuleSetup,
        software: &str,
        thresholds: &str,
        time_unix_ns: u64,
    ) -> Result<vocabulary::ModuleConfiguration, serde_json::Error> {
        Ok(vocabulary::ModuleConfiguration {
            structure: self.structure.clone(),
            module: self.module.clone(),
            software: software.to_owned(),
            fingerprint: setup_fingerprint(setup)?,
            thresholds: thresholds.to_owned(),
            reference: setup.reference.as_ref().map(|reference| reference.fingerprint()),
            setup: serde_json::to_value(setup)?,
            time_unix_ns,
        })
    }
}

/// Distinguishes a setup from others: the same on every machine.
///
/// # Errors
/// A setup that JSON has no form for; none that a diagnoser can be made of is.
pub fn setup_fingerprint(setup: &ModuleSetup) -> Result<String, serde_json::Error> {
    Ok(fingerprint(&serde_json::to_string(setup)?))
}

/// The setup that a message tells.
///
/// # Errors
/// The setup is of another version.
pub fn to_setup(
    message: &vocabulary::ModuleConfiguration,
) -> Result<ModuleSetup, serde_json::Error> {
    serde::Deserialize::deserialize(&message.setup)
}
