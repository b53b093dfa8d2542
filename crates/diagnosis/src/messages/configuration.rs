//! The setup of a diagnoser, as a message and back; and its whole state.

use base64::Engine;
use base64::prelude::BASE64_STANDARD_NO_PAD;

use vocabulary::StatePart;

use crate::state::fingerprint;
use crate::{Diagnoser, ModuleSetup};

/// Of the text of a state, so much goes into one message: no more than the longest samples have \[bytes\].
const PART_BYTES: usize = 1 << 15;

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

/// A diagnoser bit for bit, as text in parts that fit into messages: [`to_diagnoser`] of the same version of the software
/// makes it again. JSON has no form for numbers that are not finite, so the text is CBOR in base64. `about` is the same
/// in each part.
#[must_use]
pub fn from_diagnoser(diagnoser: &Diagnoser, about: &StatePart) -> Vec<StatePart> {
    let mut bytes = Vec::new();
    // Fails only if the writer does, and memory does not.
    let _ = ciborium::into_writer(diagnoser, &mut bytes);
    let text = BASE64_STANDARD_NO_PAD.encode(bytes);
    let fingerprint = fingerprint(&text);
    let parts = text.len().div_ceil(PART_BYTES) as u64;
    let part = |(part, text): (usize, &[u8])| StatePart {
        part: part as u64,
        parts,
        fingerprint: fingerprint.clone(),
        text: String::from_utf8_lossy(text).into_owned(),
        ..about.clone()
    };
    text.as_bytes().chunks(PART_BYTES).enumerate().map(part).collect()
}

/// The diagnoser that all parts of a state tell, in their order.
///
/// # Errors
/// A part is missing or was changed, or the state is of another version of the software.
pub fn to_diagnoser(parts: &[&StatePart]) -> Result<Diagnoser, String> {
    let first = parts.first().ok_or("it has no part")?;
    if first.software != env!("CARGO_PKG_VERSION") {
        return Err(format!("it is of version {} of the software", first.software));
    }
    if !(0..first.parts).eq(parts.iter().map(|part| part.part)) {
        return Err(format!("{} of its {} parts are there", parts.len(), first.parts));
    }
    let text: String = parts.iter().map(|part| part.text.as_str()).collect();
    if fingerprint(&text) != first.fingerprint {
        return Err("it was changed".to_owned());
    }
    let bytes = BASE64_STANDARD_NO_PAD.decode(text).map_err(|error| error.to_string())?;
    ciborium::from_reader(bytes.as_slice()).map_err(|error| error.to_string())
}
