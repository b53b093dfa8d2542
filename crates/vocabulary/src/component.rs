//! Components: actuators and gages, within their module and within the structure.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::name::{ActuatorName, GageName, MAX_NAME_LENGTH, ModuleName, NameError};
use crate::quotation::quotation;

/// What the schema of a message says of components; `from_str` says the same.
const PATTERN: &str = "^(actuator|sensor)/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";
const PATH_PATTERN: &str =
    "^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}/(actuator|sensor)/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";
const MENTION_PATTERN: &str =
    "^([A-Za-z0-9_][A-Za-z0-9_-]{0,63}/)?(actuator|sensor)/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";

/// What kind of component a channel watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[derive(schemars::JsonSchema)]
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
#[derive(schemars::JsonSchema)]
#[schemars(extend("pattern" = PATTERN))]
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
    /// The same, of a component somewhere in the structure.
    #[error("`{0}` names no component: write `MODULE/actuator/NAME` or `MODULE/sensor/NAME`")]
    Path(String),
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
#[derive(schemars::JsonSchema)]
#[schemars(extend("pattern" = PATH_PATTERN))]
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
        let unusable = || ComponentError::Path(quotation(text, 3 * MAX_NAME_LENGTH));
        let (module, component) = text.split_once('/').ok_or_else(unusable)?;
        let component = component.parse().map_err(|error| match error {
            ComponentError::Kind(_) => unusable(),
            other => other,
        })?;
        Ok(ComponentPath { module: module.parse()?, component })
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

/// A component as a user names it: with its module, or without if the module is known.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[derive(schemars::JsonSchema)]
#[schemars(extend("pattern" = MENTION_PATTERN))]
pub struct Mention {
    /// The module that the component is said to belong to.
    pub module: Option<ModuleName>,
    /// The component.
    pub component: Component,
}

impl Mention {
    /// Is this the component that is meant?
    #[must_use]
    pub fn may_be(&self, path: &ComponentPath) -> bool {
        self.component == path.component
            && self.module.as_ref().is_none_or(|module| *module == path.module)
    }
}

impl From<ComponentPath> for Mention {
    fn from(path: ComponentPath) -> Self {
        Self { module: Some(path.module), component: path.component }
    }
}

impl From<Component> for Mention {
    fn from(component: Component) -> Self {
        Self { module: None, component }
    }
}

impl fmt::Display for Mention {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.module {
            Some(module) => write!(f, "{module}/{}", self.component),
            None => self.component.fmt(f),
        }
    }
}

impl FromStr for Mention {
    type Err = ComponentError;

    fn from_str(text: &str) -> Result<Self, ComponentError> {
        match text.matches('/').count() {
            1 => text.parse::<Component>().map(Self::from),
            _ => text.parse::<ComponentPath>().map(Self::from),
        }
    }
}

impl TryFrom<String> for Mention {
    type Error = ComponentError;
    fn try_from(text: String) -> Result<Self, ComponentError> {
        text.parse()
    }
}

impl From<Mention> for String {
    fn from(mention: Mention) -> String {
        mention.to_string()
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
        let error = "sensor/g1".parse::<ComponentPath>().unwrap_err().to_string();
        assert!(error.starts_with("`sensor/g1` names no component: write `MODULE/"), "{error}");
    }

    #[test]
    fn components_are_mentioned_with_or_without_their_module() {
        let path: ComponentPath = "module1/sensor/g1".parse().unwrap();
        for text in ["module1/sensor/g1", "sensor/g1"] {
            let mention: Mention = text.parse().unwrap();
            assert!(mention.may_be(&path));
            assert_eq!(mention.to_string(), text);
        }
        for text in ["module2/sensor/g1", "actuator/g1", "sensor/g2"] {
            assert!(!text.parse::<Mention>().unwrap().may_be(&path));
        }
        for text in ["g1", "a/b/c", "module1/sensor/g1/x", "valve/g1", ""] {
            assert!(text.parse::<Mention>().is_err(), "{text}");
        }
    }
}
