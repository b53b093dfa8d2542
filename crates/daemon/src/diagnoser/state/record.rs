//! One record of the journal as text: a JSON object whose field `record` says what it is.

use names::RunId;
use serde::{Deserialize, Serialize};
use wire::{FaultTransition, Identification, StateChange};

/// Something worth remembering.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "record", rename_all = "snake_case")]
pub(crate) enum Record {
    /// A transition of the verdict on a component.
    Transition(Box<FaultTransition>),
    /// What was published of a fault's kind and size.
    Identification(Box<Identification>),
    /// A change whose ratio will not grow any more.
    Change {
        /// The run that its step is counted in.
        run: RunId,
        /// The change.
        change: StateChange,
    },
    /// A run ended: the steps of all transitions and changes before this are those of runs that are over, whatever the
    /// number of the next one.
    RunEnded,
    /// A process began to write here. Whether the disk takes anything shows before there is a fault.
    Start {
        /// Version of the software.
        software: String,
        /// When \[ns since 1970\].
        time_unix_ns: u64,
        /// When the first one began \[ms since 1970\]; of a journal that a former version began, none.
        #[serde(default)]
        incarnation: Option<u64>,
    },
}

impl Record {
    /// As a line.
    ///
    /// # Errors
    /// None of these has a form that JSON lacks.
    pub(crate) fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// From a line; `None` for a record that only a later version of this program can read, and for one that
    /// contradicts itself.
    pub(crate) fn from_text(text: &str) -> Option<Self> {
        let record = serde_json::from_str(text).ok()?;
        match &record {
            Self::Transition(read) if read.component.module != read.module => None,
            Self::Identification(read) if read.component.module != read.module => None,
            _ => Some(record),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transition_of_another_modules_component_is_none() {
        let (structure, component) = ("t".parse().unwrap(), "m1/sensor/g1".parse().unwrap());
        let transition = FaultTransition::untouched(structure, component, 5);
        let text = Record::Transition(Box::new(transition)).to_text().unwrap();
        assert!(Record::from_text(&text).is_some());
        let other = text.replace(r#""module":"m1""#, r#""module":"m2""#);
        assert_eq!(Record::from_text(&other), None);
    }
}
