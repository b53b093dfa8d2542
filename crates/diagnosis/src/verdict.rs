//! The life of a verdict on one component.

use vocabulary::{Component, ComponentPath, RunId, Step, Symptom, Verdict};

use vocabulary::{Evidence, GivenOrder, Shelving};

/// One numbered step in the life of a verdict.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Transition {
    /// Counts the transitions of this module from 1, without a gap.
    pub sequence: u64,
    /// The run that the steps are counted in.
    pub run: RunId,
    /// That run has ended since, though another with the same number may be under way.
    pub run_ended: bool,
    /// The component.
    pub component: Component,
    /// The new verdict.
    pub verdict: Verdict,
    /// What it rests on.
    pub symptom: Symptom,
    /// Since when the residual has been changing, as far back as the divergence shows it.
    pub onset: Step,
    /// When the divergence reached its threshold.
    pub detection: Step,
    /// As of which step the verdict was found.
    pub decided: Step,
    /// The channel at the detection.
    pub evidence: Evidence,
    /// It was so when it was first compared with its reference: it may have begun at any time before.
    pub before_service: bool,
    /// What was said to explain the change, though its module does not stand by that.
    pub disputed: Option<ComponentPath>,
    /// What an operator has commanded to subtract from what the component measures, before a comparison with its reference:
    /// of a gage \[m\], of a cylinder's oil content \[Pa\].
    pub tare: Option<f64>,
    /// The command that led to this, if one did.
    pub order: Option<GivenOrder>,
    /// If that was about the alarm alone: the command that led to the verdict, if one did.
    pub verdict_order: Option<Box<GivenOrder>>,
    /// The shelving of its alarm by an operator, if shelved. No verdict depends on it.
    pub shelved: Option<Box<Shelving>>,
    /// The suppression of its alarm while its module is maintained, if suppressed. No verdict depends on it.
    pub suppressed: Option<Box<Shelving>>,
    /// If it is a cylinder that is shut off: the command. No verdict depends on it.
    pub shut_off: Option<Box<GivenOrder>>,
}

impl Transition {
    /// Whether its steps are those of the run with this number that is under way.
    #[must_use]
    pub fn is_of(&self, run: RunId) -> bool {
        self.run == run && !self.run_ended
    }

    /// The command that led to the verdict, by this transition or by an earlier one since when nothing but the alarm's
    /// shelving or a shut-off changed.
    #[must_use]
    pub fn command(&self) -> Option<&GivenOrder> {
        let own = self.order.as_ref().filter(|order| order.kind.is_about_verdict());
        own.or(self.verdict_order.as_deref())
    }
}
