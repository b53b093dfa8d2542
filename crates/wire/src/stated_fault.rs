//! A fault that the plant states to be present.

use names::fault::Fault;
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

/// A fault of the simulated plant as its status states it. Unlike a fault to be injected, it may be one that only a
/// later version knows.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum StatedFault {
    /// One that this version knows.
    Known(Fault),
    /// One that it does not know, or not with these parameters.
    Later(LaterFault),
}

/// A fault that only a later version knows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LaterFault {
    /// What it is.
    pub kind: String,
    /// Its parameters.
    #[serde(flatten)]
    pub parameters: Map<String, Value>,
}

impl From<Fault> for StatedFault {
    fn from(fault: Fault) -> Self {
        StatedFault::Known(fault)
    }
}

impl<'de> Deserialize<'de> for StatedFault {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let later = LaterFault::deserialize(deserializer)?;
        let known = serde_json::to_value(&later).and_then(serde_json::from_value);
        Ok(known.map_or(StatedFault::Later(later), StatedFault::Known))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_that_is_not_known_keeps_its_words() {
        let bias: StatedFault = serde_json::from_str(r#"{"kind":"bias","offset_m":1e-4}"#).unwrap();
        assert_eq!(bias, Fault::Bias { offset_m: 1e-4 }.into());
        for text in [r#"{"kind":"creep","rate_per_s":1e-9}"#, r#"{"kind":"bias","offset_v":0.5}"#] {
            let later: StatedFault = serde_json::from_str(text).unwrap();
            assert!(matches!(later, StatedFault::Later(_)), "{later:?}");
            assert_eq!(serde_json::to_string(&later).unwrap(), text);
        }
        for text in ["{}", "\"bias\"", r#"{"kind":1}"#] {
            assert!(serde_json::from_str::<StatedFault>(text).is_err(), "{text}");
        }
    }
}
