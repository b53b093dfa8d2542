//! Components: actuators and gages, within their module and within the structure.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::name::{ActuatorName, GageName, MAX_NAME_LENGTH, ModuleName, NameError};
use crate::quotation::quotation;

/// What the schema of a message says of components; `from_str` says the same.
#[cfg(feature = "schema")]
const PATTERN: &str = "^(actuator|sensor)/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";
#[cfg(feature = "schema")]
const PATH_PATTERN: &str =
    "^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}/(actuator|sensor)/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";

/// What kind of component a channel watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum ComponentKind {
    /// A hydraulic actuator.
    Actuator,
    /// A strain gage.
    Sensor,
}

impl fmt::Display for ComponentKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ComponentKind::Actuator => "actuator",
            ComponentKind::Sensor => "sensor",
        })
    }
}

/// One watched component of a module: its residual is one channel. Written `actuator/NAME` or
/// `sensor/NAME`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(extend("pattern" = PATTERN)))]
pub enum Component {
    /// A hydraulic actuator.
    Actuator(ActuatorName),
    /// A strain gage.
    Sensor(GageName),
}

impl Component {
    /// Actuator or sensor.
    #[must_use]
    pub fn kind(&self) -> ComponentKind {
        match self {
            Component::Actuator(_) => ComponentKind::Actuator,
            Component::Sensor(_) => ComponentKind::Sensor,
        }
    }

    /// The name without its kind.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Component::Actuator(name) => name.as_str(),
            Component::Sensor(name) => name.as_str(),
        }
    }
}

impl fmt::Display for Component {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.kind(), self.name())
    }
}

/// A text that names no component.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ComponentError {
    /// Neither `actuator/…` nor `sensor/…`.
    #[error("`{0}` names no component: write `actuator/NAME` or `sensor/NAME`")]
    Kind(String),
    /// The part after the slash is not a name.
    #[error(transparent)]
    Name(#[from] NameError),
}

impl FromStr for Component {
    type Err = ComponentError;

    fn from_str(text: &str) -> Result<Self, ComponentError> {
        match text.split_once('/') {
            Some(("actuator", name)) => Ok(Component::Actuator(name.parse()?)),
            Some(("sensor", name)) => Ok(Component::Sensor(name.parse()?)),
            _ => Err(ComponentError::Kind(quotation(text, 2 * MAX_NAME_LENGTH))),
        }
    }
}

impl TryFrom<String> for Component {
    type Error = ComponentError;
    fn try_from(text: String) -> Result<Self, ComponentError> {
        text.parse()
    }
}

impl From<Component> for String {
    fn from(component: Component) -> String {
        component.to_string()
    }
}

/// A component somewhere in the structure. Written `MODULE/actuator/NAME` or `MODULE/sensor/NAME`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(extend("pattern" = PATH_PATTERN)))]
pub struct ComponentPath {
    /// The module that the component belongs to.
    pub module: ModuleName,
    /// The component within it.
    pub component: Component,
}

impl fmt::Display for ComponentPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.module, self.component)
    }
}

impl FromStr for ComponentPath {
    type Err = ComponentError;

    fn from_str(text: &str) -> Result<Self, ComponentError> {
        let (module, component) = text
            .split_once('/')
            .ok_or_else(|| ComponentError::Kind(quotation(text, 2 * MAX_NAME_LENGTH)))?;
        Ok(ComponentPath { module: module.parse()?, component: component.parse()? })
    }
}

impl TryFrom<String> for ComponentPath {
    type Error = ComponentError;
    fn try_from(text: String) -> Result<Self, ComponentError> {
        text.parse()
    }
}

impl From<ComponentPath> for String {
    fn from(path: ComponentPath) -> String {
        path.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_print_and_parse_back() {
        for text in ["module1/actuator/a1", "m/sensor/g"] {
            let path: ComponentPath = text.parse().unwrap();
            assert_eq!(path.to_string(), text);
        }
        assert!("module1/valve/x".parse::<ComponentPath>().is_err());
        assert!("module1".parse::<ComponentPath>().is_err());
    }
}
