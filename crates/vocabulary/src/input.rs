//! What a diagnoser took, beside its samples: with these, in order, a recording gives the same verdicts again.
//!
//! A diagnoser depends on nothing but its configuration ([`crate::ModuleConfiguration`]), its samples and these. They
//! are numbered without a gap since the start of its process. Who missed some queries `input?process=&from=&to=`; the
//! latest are kept, and the first for good. Who begins to record later queries `input?state=1`, and gets the state that the
//! inputs so far have led to. All replies have the same key: ask for them without consolidation.

use crate::{ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::change::Change;
use crate::encoding::Message;
use crate::given_order::GivenOrder;
use crate::question::{QuestionError, number};
use crate::state::{StateAnswer, StateQuestion};
use crate::transition::FaultTransition;

/// One input. It was taken after `samples` samples, the latest of which had this run and step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Input {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Which process took it: when that was started \[ns since 1970\].
    pub process: u64,
    /// Counts the inputs of the process from 1, without a gap.
    pub number: u64,
    /// How many samples the process had used by then.
    pub samples: u64,
    /// The run of the latest of them; `null` before the first.
    pub run: Option<RunId>,
    /// Its step.
    pub step: Option<Step>,
    /// When it was taken \[ns since 1970\].
    pub time_unix_ns: u64,
    /// What.
    pub taken: Taken,
}

/// What was taken.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "input", rename_all = "snake_case")]
pub enum Taken {
    /// The process began, with what it remembered of an earlier one.
    Started {
        /// Version of the software.
        software: String,
        /// Fingerprint of its configuration, as in [`crate::ModuleConfiguration::fingerprint`].
        configuration: String,
        /// What it remembered.
        remembered: Box<Remembered>,
    },
    /// The next sample used is this one, of another run or one that has begun again.
    RunBegan {
        /// Its run.
        run: RunId,
        /// Its step.
        step: Step,
    },
    /// The next sample used follows after missing ones.
    Gap {
        /// First step missing.
        from: Step,
        /// How many.
        missing: u64,
    },
    /// A sample whose step was not plausible was not used. Several of these together may be.
    Rejected {
        /// Its run.
        run: RunId,
        /// Its step.
        step: Step,
    },
    /// A peer answered.
    Answered {
        /// Its answer.
        answer: Box<StateAnswer>,
    },
    /// A peer did not answer.
    Unanswered {
        /// The peer.
        peer: ModuleName,
        /// The question.
        question: StateQuestion,
        /// In words.
        reason: String,
    },
    /// A peer that was gone is back.
    Returned {
        /// The peer.
        peer: ModuleName,
    },
    /// An operator issued a command, whether or not it was accepted.
    Ordered {
        /// The component.
        component: crate::Component,
        /// The command, who issued it, why.
        order: GivenOrder,
    },
    /// Nothing: this is the state that all inputs up to this number and all samples have led to. It is only replied to
    /// queries.
    State(Box<StatePart>),
}

/// A part of the text of a diagnoser's state. Another diagnoser of the same version goes on from it, bit for bit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct StatePart {
    /// Version of the software.
    pub software: String,
    /// Fingerprint of its configuration, as in [`crate::ModuleConfiguration::fingerprint`].
    pub configuration: String,
    /// When the latest sample was published, by the publisher's clock \[ns since 1970\].
    pub sample_time_unix_ns: Option<u64>,
    /// Which part this is, from 0.
    pub part: u64,
    /// How many there are.
    pub parts: u64,
    /// Fingerprint of the whole text.
    pub fingerprint: String,
    /// The part; its form is that of `diagnosis`.
    pub text: String,
}

/// What a process remembered of an earlier one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Remembered {
    /// The number of the latest transition; 0 if there was none.
    pub sequence: u64,
    /// The latest transition of each component that had one.
    pub latest: Vec<FaultTransition>,
    /// The run being diagnosed, and what was watched of it.
    pub watch: Option<PastWatch>,
}

/// What was watched of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PastWatch {
    /// The run.
    pub run: RunId,
    /// First and last step that every channel was watched at, if there was one.
    pub watched: Option<(Step, Step)>,
    /// The changes of the run as the diagnoser settled them, in that order. Of a change that is there twice the later one
    /// counts.
    pub changes: Vec<Change>,
}

impl Message for Input {
    const WHAT: &'static str = "input";
}

/// A question for inputs, in the parameters of a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InputQuestion {
    /// Of this process only. Of an earlier one there are those that the journal has: taken shortly before a transition.
    pub process: Option<u64>,
    /// The first number wanted; without it, the first that there is.
    pub from: Option<u64>,
    /// The last number wanted, itself included; without it, the last.
    pub to: Option<u64>,
}

impl InputQuestion {
    /// The parameters that ask for the present state instead.
    pub const STATE: &str = "state=1";

    /// The parameters of the query.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        let parts = [("process", self.process), ("from", self.from), ("to", self.to)];
        let given = parts.iter().filter_map(|(name, value)| Some(format!("{name}={}", (*value)?)));
        given.collect::<Vec<_>>().join("&")
    }

    /// Reads the parameters of a query.
    ///
    /// # Errors
    /// A parameter repeated or not a number.
    pub fn from_parameters(text: &str) -> Result<Self, QuestionError> {
        let read = |name| number(text, name);
        Ok(Self { process: read("process")?, from: read("from")?, to: read("to")? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_for_inputs_is_written_and_read_back() {
        let read = InputQuestion::from_parameters;
        for question in [
            InputQuestion::default(),
            InputQuestion { process: Some(u64::MAX), from: Some(3), to: Some(9) },
        ] {
            assert_eq!(read(&question.to_parameters()), Ok(question));
        }
        assert_eq!(read("from=1&from=2"), Err(QuestionError::Repeated("from")));
        let error = QuestionError::NotANumber { name: "to", value: "x".to_owned() };
        assert_eq!(read("to=x"), Err(error));
    }
}
