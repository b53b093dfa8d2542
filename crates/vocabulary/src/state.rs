//! What modules ask each other: "your changes from step a, as of step b?"
//!
//! The question travels as the parameters of a query, `state?from=a&step=b`, the answer as its reply.
//! The reply may come late: it is held until step b has been processed.

use crate::{ActuatorName, Component, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::change::Change;
use crate::encoding::Message;
use crate::question::{QuestionError, in_order, number, one_of, required};
use crate::window::{WindowLength, WindowMeans};

/// A question to a module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateQuestion {
    /// The run that the steps are counted in; without it, the module's present run.
    pub run: Option<RunId>,
    /// First step of interest.
    pub from: Step,
    /// The step as of which the answer is wanted, itself included.
    pub step: Step,
    /// Are the means of the window that ended with that step wanted, and of which length?
    pub window: Option<WindowLength>,
}

impl StateQuestion {
    /// The parameters of the query.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        let run = self.run.map_or(String::new(), |run| format!("&run={}", run.0));
        let window =
            self.window.map_or(String::new(), |length| format!("&window={}", length.as_str()));
        format!("from={}&step={}{run}{window}", self.from, self.step)
    }

    /// Reads the parameters of a query, separated by `&` or `;`. Other parameters are passed over.
    ///
    /// # Errors
    /// A parameter missing, repeated or not a number, or steps in the wrong order.
    pub fn from_parameters(text: &str) -> Result<Self, QuestionError> {
        let from = Step(required(text, "from")?);
        let step = Step(required(text, "step")?);
        let run = number(text, "run")?.map(RunId);
        let window = one_of(text, "window", &WindowLength::ALL, WindowLength::as_str)?;
        in_order(from, step)?;
        Ok(Self { run, from, step, window })
    }
}

/// A module's answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StateAnswer {
    /// The structure.
    pub structure: StructureName,
    /// The module that answers.
    pub module: ModuleName,
    /// The run that the steps are counted in.
    pub run: RunId,
    /// First step asked about.
    pub from_step: Step,
    /// The step as of which this is the answer.
    pub as_of_step: Step,
    /// Since when every channel has been watched; `null` while initialising.
    pub watching_since_step: Option<Step>,
    /// Changes that had begun by the second step and were not over before the first, oldest first.
    pub changes: Vec<Change>,
    /// Actuators held for faulty as of that step, whenever that was found.
    pub actuator_faults: Vec<ActuatorFault>,
    /// The components for which the module raises the alarm as of that step. A module whose component explains a
    /// change elsewhere is asked for it.
    pub alarms: Vec<Alarm>,
    /// What the module measured in the window that ended with that step, if it was asked for and there is one.
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
        for (run, window) in
            [None, Some(RunId(u64::MAX))].into_iter().zip(lengths.into_iter().rev())
        {
            let question = StateQuestion { run, from: Step(3), step: Step(99), window };
            assert_eq!(read(&question.to_parameters()), Ok(question));
        }
    }

    #[test]
    fn both_separators_are_understood_and_other_parameters_passed_over() {
        let expected = StateQuestion { run: None, from: Step(1), step: Step(2), window: None };
        for text in ["from=1&step=2", "from=1;step=2", "step=2;_anyke;from=1", "x=9&from=1&step=2"]
        {
            assert_eq!(read(text), Ok(expected), "{text}");
        }
    }

    #[test]
    fn parameters_that_make_no_question_are_named() {
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
