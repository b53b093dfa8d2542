//! A change that awaits its judgement, and what is found about it.

use vocabulary::{ComponentPath, ModuleName, Step};

use crate::verdict::Transition;
use vocabulary::{Doubt, Evidence, Verdict};

/// A change that awaits its judgement.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Case {
    /// Number of the channel.
    pub(crate) channel: usize,
    /// The step of the change.
    pub(crate) change: Step,
    /// Since when the residual had been changing.
    pub(crate) onset: Step,
    /// The channel at the change.
    pub(crate) evidence: Evidence,
    /// As of which step it is judged.
    pub(crate) decide_at: Step,
    /// If it began in a gap, it may be nothing but the models' ignorance of it.
    pub(super) of_gap: bool,
    /// Not yet published as tentative.
    pub(crate) new: bool,
    /// The peers that were last reported as silent.
    pub(super) reported: Vec<ModuleName>,
    /// Taken up after a restart: it is not certain what the module itself saw meanwhile.
    pub(super) recalled: bool,
}

impl Case {
    /// A change that has just happened, to be judged `hold` steps later.
    pub(super) fn new(
        channel: usize,
        onset: Step,
        evidence: Evidence,
        hold: u64,
        of_gap: bool,
    ) -> Self {
        Self {
            channel,
            change: evidence.step,
            onset,
            evidence,
            decide_at: evidence.step.plus(hold),
            of_gap,
            new: true,
            reported: Vec::new(),
            recalled: false,
        }
    }

    /// A change from before a restart whose verdict is still open.
    pub(super) fn recalled(channel: usize, open: &Transition, hold: u64) -> Self {
        let Transition { onset, detection, evidence, .. } = *open;
        let reported = match &open.verdict {
            Verdict::Unconfirmed { doubt: Doubt::Silent(silent) } => silent.clone(),
            _ => Vec::new(),
        };
        Self {
            channel,
            change: detection,
            onset,
            evidence,
            decide_at: detection.plus(hold),
            of_gap: false,
            new: false,
            reported,
            recalled: true,
        }
    }
}

/// What was found about a case.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Finding {
    /// It is judged, and closed.
    Judged(Judgement),
    /// These peers' answers are missing; it stays open.
    Silent(Vec<ModuleName>),
    /// These modules were not watching then; it is closed without a judgement.
    Unknowing(Vec<ModuleName>),
}

/// Root cause or effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Judgement {
    /// The change is the root: its component is faulty.
    Root,
    /// Nothing explains it: it is the root, if everybody was watching when something might have happened that does.
    First,
    /// Not an effect, because its component was a root cause before, whatever became of that verdict.
    Again,
    /// Another component's change explains it.
    Explained {
        /// That component.
        by: ComponentPath,
        /// When it changed.
        since: Step,
    },
}
