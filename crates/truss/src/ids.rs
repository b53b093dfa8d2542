//! Identifiers, steps and channels as types.
//!
//! Names travel in configuration files, in key expressions and in messages, so one alphabet serves
//! all three: ASCII letters, digits, `_` and `-`, at most [`MAX_NAME_LENGTH`] characters.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::quotation::quotation;

/// Longest name that is accepted, in characters.
pub const MAX_NAME_LENGTH: usize = 64;

/// What the schema of a message says of names; the functions below say the same.
#[cfg(feature = "schema")]
mod pattern {
    pub(super) const NAME: &str = "^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";
    pub(super) const COMPONENT: &str = "^(actuator|sensor)/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";
    pub(super) const COMPONENT_PATH: &str =
        "^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}/(actuator|sensor)/[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$";
}

/// A text that cannot serve as a name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a usable {what}: use 1 to {MAX_NAME_LENGTH} letters, digits, `_` or `-`, not starting with `-`"
)]
pub struct NameError {
    what: &'static str,
    text: String,
}

fn check_name(what: &'static str, text: &str) -> Result<(), NameError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let usable = !text.is_empty()
        && text.len() <= MAX_NAME_LENGTH
        && !text.starts_with('-')
        && text.chars().all(allowed);
    if usable {
        Ok(())
    } else {
        Err(NameError { what, text: quotation(text, MAX_NAME_LENGTH + 1) })
    }
}

macro_rules! name_type {
    ($(#[$doc:meta])* $name:ident, $what:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(try_from = "String", into = "String")]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[cfg_attr(feature = "schema", schemars(extend("pattern" = pattern::NAME)))]
        pub struct $name(String);

        impl $name {
            /// Checks the text and wraps it.
            ///
            /// # Errors
            /// A text outside the alphabet of names.
            pub fn new(text: impl Into<String>) -> Result<Self, NameError> {
                let text = text.into();
                check_name($what, &text)?;
                Ok(Self(text))
            }

            /// The bare text.
            #[must_use]
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }

        impl FromStr for $name {
            type Err = NameError;
            fn from_str(text: &str) -> Result<Self, NameError> {
                Self::new(text)
            }
        }

        impl TryFrom<String> for $name {
            type Error = NameError;
            fn try_from(text: String) -> Result<Self, NameError> {
                Self::new(text)
            }
        }

        impl From<$name> for String {
            fn from(name: $name) -> String {
                name.0
            }
        }
    };
}

name_type!(
    /// Name of a whole structure, e.g. `tower`.
    StructureName,
    "structure name"
);
name_type!(
    /// Name of a module, e.g. `module1`.
    ModuleName,
    "module name"
);
name_type!(
    /// Name of an actuator, unique in its module, e.g. `a3`.
    ActuatorName,
    "actuator name"
);
name_type!(
    /// Name of a strain gage, unique in its module, e.g. `g5`.
    GageName,
    "gage name"
);
name_type!(
    /// Name of a node, unique in its structure, e.g. `L03C2`.
    NodeName,
    "node name"
);
name_type!(
    /// Name of a member, unique in its structure.
    MemberName,
    "member name"
);
name_type!(
    /// Name of a cross-section, unique in its structure.
    SectionName,
    "section name"
);
name_type!(
    /// Name of a material, unique in its structure.
    MaterialName,
    "material name"
);

/// A sampling instant, counted from 0 within one run.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Step(pub u64);

impl Step {
    /// The step `count` later; stays at the largest step instead of overflowing.
    #[must_use]
    pub fn plus(self, count: u64) -> Step {
        Step(self.0.saturating_add(count))
    }

    /// The step `count` earlier, at least 0.
    #[must_use]
    pub fn minus(self, count: u64) -> Step {
        Step(self.0.saturating_sub(count))
    }

    /// Steps from `earlier` to here, 0 if `earlier` is later.
    #[must_use]
    pub fn since(self, earlier: Step) -> u64 {
        self.0.saturating_sub(earlier.0)
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// Tells one run of the plant (or of the data acquisition) from the next; steps restart with it.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RunId(pub u64);

impl fmt::Display for RunId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

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
#[cfg_attr(feature = "schema", schemars(extend("pattern" = pattern::COMPONENT)))]
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
#[cfg_attr(feature = "schema", schemars(extend("pattern" = pattern::COMPONENT_PATH)))]
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
    fn names_outside_the_alphabet_are_refused_and_named() {
        for bad in ["", "a/b", "a*", "-x", "ü", "a b", &"n".repeat(65)] {
            let error = ModuleName::new(bad).unwrap_err().to_string();
            assert!(error.contains("module name"), "{error}");
        }
        let forged = ModuleName::new("m\nERROR all is lost").unwrap_err().to_string();
        assert!(!forged.contains('\n'), "{forged}");
        assert_eq!(ModuleName::new("module_1-b").unwrap().as_str(), "module_1-b");
    }

    #[test]
    fn components_print_and_parse_back() {
        for text in ["module1/actuator/a1", "m/sensor/g"] {
            let path: ComponentPath = text.parse().unwrap();
            assert_eq!(path.to_string(), text);
        }
        assert!("module1/valve/x".parse::<ComponentPath>().is_err());
        assert!("module1".parse::<ComponentPath>().is_err());
    }

    #[test]
    fn steps_do_not_overflow() {
        assert_eq!(Step(u64::MAX).plus(5), Step(u64::MAX));
        assert_eq!(Step(3).minus(5), Step(0));
        assert_eq!(Step(3).since(Step(5)), 0);
    }
}
