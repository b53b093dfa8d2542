//! What modules ask each other: "your changes from step a, as of step b?"
//!
//! The question travels as the parameters of a query, `state?run=r&from=a&step=b`, the answer as its reply.
//! An answer is a statement about steps, not about the moment it is given: a module that has not yet processed step b holds
//! its answer until it has. The verdicts of the modules together are then those of one process, whatever the network's
//! timing.

use crate::{ActuatorName, Component, ModuleName, RunId, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::change::Change;
use crate::encoding::Message;
use crate::question::{QuestionError, in_order, one_of, required};
use crate::window::{WindowLength, WindowMeans};

/// A question to a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct StateQuestion {
    /// The run that the steps are counted in.
    pub run: RunId,
    /// First step of interest.
    #[serde(rename = "from_step")]
    pub from: Step,
    /// The step as of which the answer is wanted, itself included.
    #[serde(rename = "as_of_step")]
    pub as_of: Step,
    /// Length of the window that ended with that step, if its means are wanted.
    pub window: Option<WindowLength>,
}

impl StateQuestion {
    /// The parameters of the query.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        let Self { run, from, as_of, window } = self;
        let window = window.map_or(String::new(), |length| format!("&window={}", length.as_str()));
        format!("run={run}&from={from}&step={as_of}{window}")
    }

    /// Reads the parameters of a query, separated by `&` or `;`. Other parameters are passed over.
    ///
    /// # Errors
    /// A parameter missing, repeated or not a number, or steps in the wrong order.
    pub fn from_parameters(text: &str) -> Result<Self, QuestionError> {
        let run = RunId(required(text, "run")?);
        let from = Step(required(text, "from")?);
        let as_of = Step(required(text, "step")?);
        let window = one_of(text, "window", &WindowLength::ALL, WindowLength::as_str)?;
        in_order(from, as_of)?;
        Ok(Self { run, from, as_of, window })
    }
}

/// A module's answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StateAnswer {
    /// The module that answers.
    pub module: ModuleName,
    /// The question that is answered.
    pub question: StateQuestion,
    /// Since which step every channel has been watched; `null` while initialising.
    #[serde(rename = "watching_since_step")]
    pub watching_since: Option<Step>,
    /// Changes that had begun by the second step of the question and had not ended before the first, oldest first.
    pub changes: Vec<Change>,
    /// Actuators declared faulty as of that step, whenever that was found.
    pub actuator_faults: Vec<ActuatorFault>,
    /// The components for which the module raises the alarm as of that step. A module whose component explains a
    /// change elsewhere is asked for it.
    pub alarms: Vec<Alarm>,
    /// Components with a change by that step that is not judged yet.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pending: Vec<Component>,
    /// The means of the window that ended with that step, if they are wanted and there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<WindowMeans>,
}

/// An actuator held for faulty.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ActuatorFault {
    /// The actuator.
    pub actuator: ActuatorName,
    /// The step of the change that named it.
    pub step: Step,
}

/// A component for which a module raises the alarm.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Alarm {
    /// The component.
    pub component: Component,
    /// The step of the change that is the reason.
    pub step: Step,
    /// It is held for faulty. Otherwise its change could not be judged, or an operator has reset it.
    pub faulty: bool,
}

impl Message for StateAnswer {
    const WHAT: &'static str = "state answer";
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<StateQuestion, QuestionError> {
        StateQuestion::from_parameters(text)
    }

    #[test]
    fn a_question_is_written_and_read_back() {
        let lengths = [None, Some(WindowLength::Short), Some(WindowLength::Long)];
        for window in lengths {
            let (run, from, as_of) = (RunId(u64::MAX), Step(3), Step(99));
            let question = StateQuestion { run, from, as_of, window };
            assert_eq!(read(&question.to_parameters()), Ok(question));
        }
    }

    #[test]
    fn both_separators_are_understood_and_other_parameters_passed_over() {
        let (run, from, as_of) = (RunId(7), Step(1), Step(2));
        let expected = StateQuestion { run, from, as_of, window: None };
        for text in [
            "run=7&from=1&step=2",
            "run=7;from=1;step=2",
            "step=2;_anyke;from=1;run=7",
            "x=9&from=1&step=2&run=7",
        ] {
            assert_eq!(read(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn parameters_that_make_no_question_are_named() {
        assert_eq!(read("from=1&step=2"), Err(QuestionError::Missing("run")));
        let read = |text: &str| read(&format!("run=7&{text}"));
        assert_eq!(read(""), Err(QuestionError::Missing("from")));
        assert_eq!(read("from=1"), Err(QuestionError::Missing("step")));
        assert_eq!(read("from=1&from=2&step=3"), Err(QuestionError::Repeated("from")));
        let unknown = read("from=1&step=2&window=7").unwrap_err();
        assert_eq!(unknown.to_string(), "`window` is `7`; use 0.1 or 1");
        let backwards = QuestionError::Backwards { from: Step(3), to: Step(2) };
        assert_eq!(read("from=3&step=2"), Err(backwards));
        for (text, value) in [("from=-1&step=2", "-1"), ("from=&step=2", ""), ("from&step=2", "")] {
            let error = QuestionError::NotANumber { name: "from", value: value.into() };
            assert_eq!(read(text), Err(error), "{text}");
        }
    }
}
