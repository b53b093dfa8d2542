//! What modules ask each other: "your changes from step a, as of step b?"
//!
//! The question travels as the parameters of a query, `state?from=a&step=b`, the answer as its reply.
//! The reply may come late: it is held until step b has been processed.

use names::{ActuatorName, Component, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::question::{QuestionError, in_order, number, one_of, required};

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

/// How long a window is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WindowLength {
    /// A tenth of a second, `0.1`.
    Short,
    /// A second, `1`.
    Long,
}

impl WindowLength {
    /// Both.
    pub const ALL: [WindowLength; 2] = [WindowLength::Short, WindowLength::Long];

    /// In seconds, as in the parameters of a query.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            WindowLength::Short => "0.1",
            WindowLength::Long => "1",
        }
    }
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
    pub changes: Vec<StateChange>,
    /// Actuators held for faulty as of that step, whenever that was found.
    pub actuator_faults: Vec<ActuatorFault>,
    /// The components for which the module raises the alarm as of that step. A module whose component explains a
    /// change elsewhere is asked for it.
    pub alarms: Vec<Alarm>,
    /// What the module measured in the window that ended with that step, if it was asked for and there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
}

/// Means over a window, which begins and ends at the same steps in every module.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Window {
    /// Of each gage, in the order of the description; `null` without enough values.
    pub gages: Vec<Option<GageWindow>>,
    /// Of each cylinder, likewise.
    pub cylinders: Vec<Option<CylinderWindow>>,
}

/// A gage over a window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GageWindow {
    /// Mean residual \[m\].
    pub residual_m: f64,
    /// Variance of the reading's white noise \[m²\].
    pub scatter_m2: f64,
    /// Variance of the residual within the window \[m²\].
    pub swing_m2: f64,
}

/// A cylinder over a window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CylinderWindow {
    /// Mean observed force \[N\].
    pub force_n: f64,
    /// How fast it rises \[N/s\].
    pub rate_n_per_s: f64,
    /// Mean tracking residual \[N\].
    pub tracking_n: f64,
    /// Mean pressure of both chambers, weighted by their areas \[Pa\].
    pub content_pa: f64,
}

/// A change in an answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StateChange {
    /// The component whose channel changed.
    pub component: Component,
    /// The step at which the divergence reached its threshold.
    pub step: Step,
    /// Since when the residual may have been changing, if that is earlier.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub onset_step: Option<Step>,
    /// Divergence by threshold at its largest while the change was fresh.
    pub ratio: f64,
    /// The last step at which the divergence was at its threshold or above, if the change was over by then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_step: Option<Step>,
    /// The change was not over by then.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub going_on: bool,
}

impl StateChange {
    /// A change of which neither onset nor end is known.
    #[must_use]
    pub fn at(component: Component, step: Step, ratio: f64) -> Self {
        Self { component, step, onset_step: None, ratio, until_step: None, going_on: false }
    }
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
