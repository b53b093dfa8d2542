//! Journal records as text: JSON objects whose field `record` names the kind.

use serde::{Deserialize, Serialize};
use vocabulary::{Change, FaultTransition, Identification, Input, PhaseChange, RunId, Step};

/// Version of the records.
pub const JOURNAL_VERSION: u64 = 1;

/// A journal record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "record", rename_all = "snake_case")]
pub enum JournalRecord {
    /// A transition of the verdict on a component.
    Transition(Box<FaultTransition>),
    /// A published identification of a fault.
    Identification(Box<Identification>),
    /// A change of the phase, or of the components that the module monitors.
    Phase(Box<PhaseChange>),
    /// An input taken before the following transition: a killed process may not have published it, and without it the
    /// transition cannot be replayed.
    Input(Box<Input>),
    /// A change whose ratio will not increase any more.
    Change {
        /// The run that its step belongs to.
        run: RunId,
        /// The change.
        change: Change,
    },
    /// A run ended: the steps of all earlier transitions and changes belong to ended runs, whatever the number of the
    /// next run.
    RunEnded,
    /// A process started to write here. The write shows whether the disk works before there is a fault.
    Start {
        /// Version of the records that follow.
        v: u64,
        /// Version of the software.
        software: String,
        /// The time \[ns since 1970\].
        time_unix_ns: u64,
        /// The incarnation: when the first process started here \[ms since 1970\].
        incarnation: u64,
    },
}

impl JournalRecord {
    /// The record as a line.
    ///
    /// # Errors
    /// None in practice: JSON can represent all records.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// Parses a line; `None` if it is not a record or contradicts itself.
    #[must_use]
    pub fn from_text(text: &str) -> Option<Self> {
        let record = serde_json::from_str(text).ok()?;
        match &record {
            Self::Transition(read) if read.component.module != read.module => None,
            Self::Identification(read) if read.component.module != read.module => None,
            Self::Phase(read)
                if read.not_monitored.keys().any(|component| component.module != read.module) =>
            {
                None
            }
            _ => Some(record),
        }
    }
}

/// All channels were watched from the first to the last of these steps. Stored in a separate file, which is
/// overwritten.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct WatchedSteps {
    /// The run.
    pub run: RunId,
    /// First and last step; `None` while initialising.
    pub watched: Option<(Step, Step)>,
}

/// Checks that this version of the program can read these records of a journal.
///
/// # Errors
/// Another version wrote one of them.
pub fn check_version(records: &[String]) -> Result<(), String> {
    #[derive(Deserialize)]
    struct Head {
        record: String,
        v: Option<u64>,
    }
    for text in records {
        match serde_json::from_str(text) {
            Ok(Head { record, v }) if record == "start" && v != Some(JOURNAL_VERSION) => {
                let found =
                    v.map_or("it has no version".to_owned(), |v| format!("its version is {v}"));
                return Err(format!("{found}, this program reads {JOURNAL_VERSION}"));
            }
            _ => {}
        }
        let read = serde_json::from_str::<JournalRecord>(text);
        read.map_err(|error| format!("a record cannot be read ({error})"))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_of_another_version_are_refused() {
        let start =
            r#"{"record":"start","v":1,"software":"0.2.0","time_unix_ns":5,"incarnation":5}"#;
        let other = start.replace(r#""v":1"#, r#""v":2"#);
        let without = start.replace(r#""v":1,"#, "");
        let unknown = r#"{"record":"weighing","v":1}"#.to_owned();
        let check = |texts: &[&str]| {
            check_version(&texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(check(&[start, start]), Ok(()));
        let refused = |text: &str| check(&[start, text]).unwrap_err();
        assert_eq!(refused(&other), "its version is 2, this program reads 1");
        assert_eq!(refused(&without), "it has no version, this program reads 1");
        assert!(refused(&unknown).contains("unknown variant `weighing`"));
    }

    #[test]
    fn a_transition_of_another_modules_component_is_none() {
        let (structure, component) = ("t".parse().unwrap(), "m1/sensor/g1".parse().unwrap());
        let transition = FaultTransition::untouched(structure, component, 5);
        let text = JournalRecord::Transition(Box::new(transition)).to_text().unwrap();
        assert!(JournalRecord::from_text(&text).is_some());
        let other = text.replace(r#""module":"m1""#, r#""module":"m2""#);
        assert_eq!(JournalRecord::from_text(&other), None);
    }
}
