//! What is compared between a distributed run and the same run in one process.

use diagnosis::{Transition, Verdict};
use vocabulary::{ComponentPath, FaultTransition, ModuleName, Step};

/// A verdict that was reached.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Reached {
    /// The component.
    pub component: ComponentPath,
    /// `latched`, or what explains the change.
    pub outcome: String,
    /// Onset of the change.
    pub onset: Step,
    /// Its detection.
    pub detection: Step,
    /// As of which step the verdict was found.
    pub decided: Step,
}

impl Reached {
    /// From a transition in one process; `None` if it is not a final verdict.
    #[must_use]
    pub fn of_transition(module: &ModuleName, transition: &Transition) -> Option<Self> {
        let outcome = match &transition.verdict {
            Verdict::Latched => "latched".to_string(),
            Verdict::Explained { by, since } => format!("explained by {by} since {since}"),
            _ => return None,
        };
        Some(Self {
            component: ComponentPath {
                module: module.clone(),
                component: transition.component.clone(),
            },
            outcome,
            onset: transition.onset,
            detection: transition.detection,
            decided: transition.decided,
        })
    }

    /// From a message; `None` if it is not a final verdict.
    #[must_use]
    pub fn of_message(message: &FaultTransition) -> Option<Self> {
        let outcome = match &message.verdict {
            vocabulary::Verdict::Latched => "latched".to_string(),
            vocabulary::Verdict::Explained { by, since } => {
                format!("explained by {by} since {since}")
            }
            _ => return None,
        };
        Some(Self {
            component: message.component.clone(),
            outcome,
            onset: message.onset_step?,
            detection: message.detection_step?,
            decided: message.decided_step?,
        })
    }
}
