//! The diagnosers' statements on the fault of a case.

use diagnosis::Verdict;
use diagnosis::identification::{DECIDED, IdentificationResult};
use serde::{Deserialize, Serialize};
use vocabulary::{ComponentPath, IdentifiedKind, Step, fault::FaultKind};

use super::draw::IdentificationTask;
use crate::case::{CampaignCase, CaseRun};
use crate::conditions::Situation;
use crate::error::StudyError;
use crate::group::RigEvent;

/// The identification of the fault at some time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdentificationStatement {
    /// Time since the component was declared faulty \[s\].
    pub after_s: f64,
    /// The possible kinds with their probabilities, most probable first.
    pub kinds: Vec<(IdentifiedKind, f64)>,
    /// The size of the most probable kind, if it has one: lower end, middle, upper end.
    pub size: Option<[f64; 3]>,
}

impl IdentificationStatement {
    fn of(found: &IdentificationResult, after_s: f64) -> Self {
        let size = found.candidates.first().and_then(|first| first.size);
        Self {
            after_s,
            kinds: found.candidates.iter().map(|c| (c.kind, c.probability)).collect(),
            size: size.map(|size| [size.low, size.value, size.high]),
        }
    }

    /// The kind, if it is decided.
    #[must_use]
    pub fn decided(&self) -> Option<IdentifiedKind> {
        self.kinds.first().filter(|(_, probability)| *probability >= DECIDED).map(|(kind, _)| *kind)
    }
}

/// The result of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct IdentificationRow {
    /// The other events.
    pub situation: Situation,
    /// The faulty component.
    pub component: ComponentPath,
    /// The fault in words.
    pub fault: String,
    /// What it is to be identified as: its kind, or none of these if that was left out.
    pub kind: IdentifiedKind,
    /// Its size in the unit of its kind, if it has one.
    pub size: Option<f64>,
    /// The size in limits of its kind, if it has one.
    pub in_limits: Option<f64>,
    /// Time from the fault's first sample to the step as of which the component was declared faulty \[s\]; `None` if it
    /// never was, or was before.
    pub named_after_s: Option<f64>,
    /// The identifications, in order.
    pub words: Vec<IdentificationStatement>,
}

impl IdentificationRow {
    /// Runs a case.
    pub(super) fn of(
        case: &CampaignCase<IdentificationTask>,
        run: &mut CaseRun,
        step_s: f64,
        without: Option<FaultKind>,
    ) -> Result<Self, StudyError> {
        run.rig.identify(without);
        run.finish()?;
        let subject = case.faults.last().ok_or(StudyError::NothingToBreak)?;
        let kind = Some(subject.fault.kind()).filter(|kind| Some(*kind) != without);
        let mut row = Self {
            situation: case.kind.situation,
            component: subject.component.clone(),
            fault: subject.fault.to_string(),
            kind: kind.map_or(IdentifiedKind::NoneOfThese, IdentifiedKind::Known),
            size: subject.fault.size(),
            in_limits: case.kind.in_limits,
            named_after_s: None,
            words: Vec::new(),
        };
        let mut named = None;
        for occurrence in &run.occurrences {
            if let Some((component, transition)) = occurrence.transition() {
                let is_latched = transition.verdict == Verdict::Latched;
                if is_latched && component == subject.component {
                    named.get_or_insert(transition.decided);
                }
            }
            let RigEvent::Identified { module, identification } = occurrence else { continue };
            let ComponentPath { module: own, component } = &subject.component;
            if (module, &identification.component) == (own, component) {
                let after_s = seconds(named.unwrap_or(subject.at), identification.as_of, step_s);
                row.words.push(IdentificationStatement::of(identification, after_s));
            }
        }
        let named = named.filter(|step| *step >= subject.at);
        row.named_after_s = named.map(|step| seconds(subject.at, step, step_s));
        Ok(row)
    }

    /// The kind decided within a time after the component was declared faulty; `None` if it never was decided.
    pub(super) fn decided_within(&self, time_s: f64) -> Option<IdentifiedKind> {
        self.named_after_s?;
        self.within(time_s)?.decided()
    }

    /// The latest identification within a time after the component was declared faulty.
    #[must_use]
    pub fn within(&self, time_s: f64) -> Option<&IdentificationStatement> {
        self.words.iter().rev().find(|word| word.after_s <= time_s + 1e-9)
    }
}

fn seconds(from: Step, until: Step, step_s: f64) -> f64 {
    // A billionth of a second is finer than any step.
    (until.since(from) as f64 * step_s * 1e9).round() / 1e9
}
