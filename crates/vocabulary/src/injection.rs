//! Orders to the simulated plant.

use crate::fault::Fault;
use crate::{ComponentPath, Mention, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// Give a component a fault, or repair it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("required" = ["component", "fault"]))]
pub struct Injection {
    /// The component, with its module, or without if only one module has it.
    pub component: Mention,
    /// The fault, in place of any it has; `null` repairs the component.
    #[serde(deserialize_with = "Option::deserialize")]
    pub fault: Option<Fault>,
    /// From which step on; without it, from the next.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_step: Option<Step>,
}

/// The plant accepted the injection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Injected {
    /// The component.
    pub component: ComponentPath,
    /// The first step that shows it.
    pub effective_step: Step,
}

impl Message for Injection {
    const WHAT: &'static str = "injection";
}

impl Message for Injected {
    const WHAT: &'static str = "injection's reply";
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode;

    #[test]
    fn a_repair_says_so_and_a_forgotten_fault_is_no_repair() {
        let repair = br#"{"v":1,"component":"m/sensor/g","fault":null}"#;
        assert_eq!(decode::<Injection>(repair).unwrap().fault, None);
        let forgotten = br#"{"v":1,"component":"m/sensor/g"}"#;
        assert!(decode::<Injection>(forgotten).unwrap_err().to_string().contains("fault"));
    }

    #[test]
    fn a_misspelt_parameter_of_a_fault_is_refused() {
        let text = br#"{"v":1,"component":"m/sensor/g","fault":{"kind":"bias","offset":1}}"#;
        assert!(decode::<Injection>(text).is_err());
    }
}
