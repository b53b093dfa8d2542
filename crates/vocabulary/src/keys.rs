//! Key expressions, made and read in this one place.
//!
//! ```
//! use vocabulary::{Key, Topic};
//! let structure = "tower".parse()?;
//! let fault = Topic::Fault("sensor/g5".parse()?);
//! let key = Key::of_module(&structure, &"module1".parse()?, fault);
//! assert_eq!(key.to_string(), "trusswatch/tower/module1/fault/sensor/g5");
//! assert_eq!("trusswatch/tower/module1/fault/sensor/g5".parse(), Ok(key));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::fmt;
use std::str::FromStr;

use crate::{Component, ComponentError, ModuleName, NameError, OperatorName, StructureName};

use crate::order::OrderKind;

/// First part of every key.
pub const ROOT: &str = "trusswatch";

/// What stands in the place of a module in the plant's keys; no module may be called so.
pub const PLANT: &str = "plant";

/// A key without an owner: a query on it ends at once without an answer, if the network works.
pub const UNOWNED: &str = "trusswatch/nobody";

/// What a module's key is about.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topic {
    /// Its measurements, each step; a query on this key asks for past ones.
    Sample,
    /// Its divergences.
    Divergence,
    /// What its gages read, or should read if they are faulty, each step.
    Corrected,
    /// What its cylinders can still do.
    Capability,
    /// A divergence crossed its threshold.
    Change,
    /// Transitions of the verdict on one component.
    Fault(Component),
    /// What kind of fault one component has, and how large it is.
    Identification(Component),
    /// Peers' questions.
    State,
    /// Once a second.
    Status,
    /// How far it has come.
    Progress,
    /// It entered another phase.
    Phase,
    /// Its journal.
    History,
    /// What its diagnoser took beside samples; a query on this key asks for past ones.
    Input,
    /// What its diagnoser was set up with.
    Configuration,
    /// What it saw around the onset of a fault.
    FreezeFrame,
    /// Commands whose message names the issuer.
    Command(OrderKind),
    /// Commands of an operator; access control admits only that operator to this key.
    CommandOf(OrderKind, OperatorName),
    /// Its liveliness token.
    Alive,
}

/// What a key of the simulated plant is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PlantTopic {
    /// Add or clear a fault.
    Inject,
    /// Let a cylinder make a stroke.
    Stroke,
    /// Once a second.
    Status,
    /// Its liveliness token.
    Alive,
}

/// A key without wildcards.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Key {
    /// Of a module's diagnoser.
    Module {
        /// The structure.
        structure: StructureName,
        /// The module.
        module: ModuleName,
        /// What about it.
        topic: Topic,
    },
    /// Of the plant.
    Plant {
        /// The structure.
        structure: StructureName,
        /// What about it.
        topic: PlantTopic,
    },
}

/// An invalid key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// It does not start right or has too few parts.
    #[error("key does not read `{ROOT}/STRUCTURE/MODULE/TOPIC`")]
    Form,
    /// The last parts are not a topic.
    #[error("`{0}` is not a topic")]
    Topic(String),
    /// A part is not a name.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The component of a fault or an identification is invalid.
    #[error(transparent)]
    Component(#[from] ComponentError),
}

impl Key {
    /// A module's key.
    #[must_use]
    pub fn of_module(structure: &StructureName, module: &ModuleName, topic: Topic) -> Self {
        Key::Module { structure: structure.clone(), module: module.clone(), topic }
    }

    /// A key of the plant.
    #[must_use]
    pub fn of_plant(structure: &StructureName, topic: PlantTopic) -> Self {
        Key::Plant { structure: structure.clone(), topic }
    }
}

impl fmt::Display for Topic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Topic::Sample => f.write_str("sample"),
            Topic::Divergence => f.write_str("divergence"),
            Topic::Corrected => f.write_str("corrected"),
            Topic::Capability => f.write_str("capability"),
            Topic::Change => f.write_str("change"),
            Topic::Fault(component) => write!(f, "fault/{component}"),
            Topic::Identification(component) => write!(f, "identification/{component}"),
            Topic::State => f.write_str("state"),
            Topic::Status => f.write_str("status"),
            Topic::Progress => f.write_str("progress"),
            Topic::Phase => f.write_str("phase"),
            Topic::History => f.write_str("history"),
            Topic::Input => f.write_str("input"),
            Topic::Configuration => f.write_str("configuration"),
            Topic::FreezeFrame => f.write_str("freeze-frame"),
            Topic::Command(order) => write!(f, "command/{}", order.as_str()),
            Topic::CommandOf(order, by) => write!(f, "command/{}/{by}", order.as_str()),
            Topic::Alive => f.write_str("alive"),
        }
    }
}

impl FromStr for Topic {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        if let Some(component) = text.strip_prefix("fault/") {
            return Ok(Topic::Fault(component.parse()?));
        }
        if let Some(component) = text.strip_prefix("identification/") {
            return Ok(Topic::Identification(component.parse()?));
        }
        for order in OrderKind::ALL {
            let rest = text.strip_prefix("command/").and_then(|t| t.strip_prefix(order.as_str()));
            match rest {
                Some("") => return Ok(Topic::Command(order)),
                Some(rest) if rest.starts_with('/') => {
                    return Ok(Topic::CommandOf(order, rest[1..].parse()?));
                }
                _ => {}
            }
        }
        match text {
            "sample" => Ok(Topic::Sample),
            "divergence" => Ok(Topic::Divergence),
            "corrected" => Ok(Topic::Corrected),
            "capability" => Ok(Topic::Capability),
            "change" => Ok(Topic::Change),
            "state" => Ok(Topic::State),
            "status" => Ok(Topic::Status),
            "progress" => Ok(Topic::Progress),
            "phase" => Ok(Topic::Phase),
            "history" => Ok(Topic::History),
            "input" => Ok(Topic::Input),
            "configuration" => Ok(Topic::Configuration),
            "freeze-frame" => Ok(Topic::FreezeFrame),
            "alive" => Ok(Topic::Alive),
            other => Err(KeyError::Topic(quoted(other))),
        }
    }
}

impl fmt::Display for PlantTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PlantTopic::Inject => "command/inject",
            PlantTopic::Stroke => "command/stroke",
            PlantTopic::Status => "status",
            PlantTopic::Alive => "alive",
        })
    }
}

impl FromStr for PlantTopic {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        match text {
            "command/inject" => Ok(PlantTopic::Inject),
            "command/stroke" => Ok(PlantTopic::Stroke),
            "status" => Ok(PlantTopic::Status),
            "alive" => Ok(PlantTopic::Alive),
            other => Err(KeyError::Topic(quoted(other))),
        }
    }
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Key::Module { structure, module, topic } => {
                write!(f, "{ROOT}/{structure}/{module}/{topic}")
            }
            Key::Plant { structure, topic } => write!(f, "{ROOT}/{structure}/{PLANT}/{topic}"),
        }
    }
}

impl FromStr for Key {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        let mut parts = text.splitn(4, '/');
        let mut part = || parts.next().ok_or(KeyError::Form);
        if part()? != ROOT {
            return Err(KeyError::Form);
        }
        let structure = part()?.parse()?;
        match (part()?, part()?) {
            (PLANT, topic) => Ok(Key::Plant { structure, topic: topic.parse()? }),
            (module, topic) => {
                Ok(Key::Module { structure, module: module.parse()?, topic: topic.parse()? })
            }
        }
    }
}

/// Key expressions for monitoring clients: several structures, modules and components at once.
#[derive(Debug, Clone, Copy, Default)]
pub struct Watched<'a> {
    /// This structure only.
    pub structure: Option<&'a StructureName>,
    /// This module only.
    pub module: Option<&'a ModuleName>,
}

impl Watched<'_> {
    /// Fault transitions of all components.
    #[must_use]
    pub fn faults(&self) -> String {
        self.expression("fault/**")
    }

    /// What kinds of faults all components have.
    #[must_use]
    pub fn identifications(&self) -> String {
        self.expression("identification/**")
    }

    /// Changes.
    #[must_use]
    pub fn changes(&self) -> String {
        self.expression(&Topic::Change.to_string())
    }

    /// Divergences.
    #[must_use]
    pub fn divergences(&self) -> String {
        self.expression(&Topic::Divergence.to_string())
    }

    /// Corrected readings.
    #[must_use]
    pub fn corrected(&self) -> String {
        self.expression(&Topic::Corrected.to_string())
    }

    /// What cylinders can do.
    #[must_use]
    pub fn capabilities(&self) -> String {
        self.expression(&Topic::Capability.to_string())
    }

    /// Status of modules, and of the plant unless a module is named.
    #[must_use]
    pub fn statuses(&self) -> String {
        self.expression(&Topic::Status.to_string())
    }

    /// Liveliness tokens of modules, and of the plant unless a module is named.
    #[must_use]
    pub fn tokens(&self) -> String {
        self.expression(&Topic::Alive.to_string())
    }

    /// How far the modules have come.
    #[must_use]
    pub fn progress(&self) -> String {
        self.expression(&Topic::Progress.to_string())
    }

    /// Changes of phase.
    #[must_use]
    pub fn phases(&self) -> String {
        self.expression(&Topic::Phase.to_string())
    }

    /// Journals.
    #[must_use]
    pub fn histories(&self) -> String {
        self.expression(&Topic::History.to_string())
    }

    /// What diagnosers took beside samples.
    #[must_use]
    pub fn inputs(&self) -> String {
        self.expression(&Topic::Input.to_string())
    }

    /// What diagnosers were set up with.
    #[must_use]
    pub fn configurations(&self) -> String {
        self.expression(&Topic::Configuration.to_string())
    }

    /// What diagnosers saw around the onsets of faults.
    #[must_use]
    pub fn freeze_frames(&self) -> String {
        self.expression(&Topic::FreezeFrame.to_string())
    }

    /// Samples.
    #[must_use]
    pub fn samples(&self) -> String {
        self.expression(&Topic::Sample.to_string())
    }

    fn expression(&self, topic: &str) -> String {
        let structure = self.structure.map_or("*", StructureName::as_str);
        let module = self.module.map_or("*", ModuleName::as_str);
        format!("{ROOT}/{structure}/{module}/{topic}")
    }
}

fn quoted(text: &str) -> String {
    crate::quotation(text, 64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_that_are_no_keys_are_distinguished() {
        let parse = |text: &str| text.parse::<Key>().unwrap_err();
        for text in ["", "trusswatch", "trusswatch/tower/module1", "other/tower/module1/sample"] {
            assert_eq!(parse(text), KeyError::Form, "{text}");
        }
        assert_eq!(parse("trusswatch/t/m/samples"), KeyError::Topic("samples".into()));
        assert_eq!(parse("trusswatch/t/m/a\nb"), KeyError::Topic("a\\nb".into()));
        assert_eq!(parse("trusswatch/t/m/sample/"), KeyError::Topic("sample/".into()));
        assert_eq!(parse("trusswatch/t/plant/sample"), KeyError::Topic("sample".into()));
        assert!(matches!(parse("trusswatch/t/*/sample"), KeyError::Name(_)));
        assert!(matches!(parse("trusswatch//m/sample"), KeyError::Name(_)));
        assert!(matches!(parse("trusswatch/t/m/fault/valve/x"), KeyError::Component(_)));
        assert!(matches!(parse("trusswatch/t/m/identification/x"), KeyError::Component(_)));
        assert!(matches!(parse("trusswatch/t/m/fault/sensor/a/b"), KeyError::Component(_)));
    }

    #[test]
    fn the_expression_of_everybodys_faults_is_the_one_in_the_manual() {
        assert_eq!(Watched::default().faults(), "trusswatch/*/*/fault/**");
        let structure = "tower".parse().unwrap();
        let module = "module1".parse().unwrap();
        let watched = Watched { structure: Some(&structure), module: Some(&module) };
        assert_eq!(watched.statuses(), "trusswatch/tower/module1/status");
    }
}
