//! What a diagnoser saw around the onset of a fault: two seconds before the transition that latched it, two after.
//!
//! The question travels as the parameters of a query, `freeze-frame?transition=17`. Without the parameter, every frame
//! that is kept is given, without its signals.

use crate::{ComponentPath, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::question::{QuestionError, number};

/// A freeze frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FreezeFrame {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The component that was latched.
    pub component: ComponentPath,
    /// The number of the transition that latched it.
    pub sequence: u64,
    /// What `sequence` counts in, as in [`crate::FaultTransition::incarnation`].
    pub incarnation: u64,
    /// The run that the steps are counted in.
    pub run: RunId,
    /// Length of a step \[s\].
    pub step_s: f64,
    /// Since when the residual has been changing.
    pub onset_step: Step,
    /// When the divergence reached its threshold, or the departure was found.
    pub detection_step: Step,
    /// As of which step the fault was latched.
    pub decided_step: Step,
    /// The threshold of its divergence.
    pub threshold: f64,
    /// When the frame was complete \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The steps that the values belong to, in order; a step whose sample was missing is left out.
    pub steps: Vec<Step>,
    /// What was measured and computed of the component.
    pub traces: Vec<Trace>,
}

/// One signal of a freeze frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Trace {
    /// `residual`, `divergence`; of a gage `reading`; of a cylinder `demand`, `force`, `pressure_a`, `pressure_b`.
    pub name: String,
    /// Its unit: `m`, `N`, `Pa`, or `1`.
    pub unit: String,
    /// One value for each of `steps`; `null` where there is none.
    pub values: Vec<Option<f64>>,
}

impl Message for FreezeFrame {
    const WHAT: &'static str = "freeze frame";
}

/// A question for a freeze frame, in the parameters of a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FreezeFrameQuestion {
    /// The number of the transition; without it, which frames there are.
    pub transition: Option<u64>,
}

impl FreezeFrameQuestion {
    /// The parameters of the query.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        self.transition.map_or_else(String::new, |number| format!("transition={number}"))
    }

    /// Reads the parameters of a query.
    ///
    /// # Errors
    /// A parameter repeated or not a number.
    pub fn from_parameters(text: &str) -> Result<Self, QuestionError> {
        Ok(Self { transition: number(text, "transition")? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_for_a_frame_is_written_and_read_back() {
        for transition in [None, Some(17)] {
            let question = FreezeFrameQuestion { transition };
            assert_eq!(
                FreezeFrameQuestion::from_parameters(&question.to_parameters()),
                Ok(question)
            );
        }
        assert!(FreezeFrameQuestion::from_parameters("transition=-1").is_err());
    }
}
