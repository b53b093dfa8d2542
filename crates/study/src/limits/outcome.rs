//! The findings of a detector in a run: when the fault was found, and when the right component was identified.

use diagnosis::{Symptom, Verdict};
use serde::{Deserialize, Serialize};
use vocabulary::{ComponentPath, Step};

use super::question::LimitDetector;
use crate::conditions::{Standing, standing};
use crate::group::Diagnosed;
use crate::rig::{Rig, TimedFault};

/// When the fault was found, and when the right component was identified, in steps from the fault's first sample on,
/// which is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LimitRow {
    /// When the fault was found; `None` if it was not.
    pub found: Option<u64>,
    /// When the right component was identified, likewise.
    pub right: Option<u64>,
}

impl LimitRow {
    /// Evaluates the components declared faulty in a run with this fault.
    pub(super) fn of_isolation(diagnosed: &[Diagnosed], fault: &TimedFault) -> Self {
        let is_false_alarm = diagnosed.iter().any(|of| of.detection < fault.at);
        let mut named = diagnosed.iter().filter(|of| of.detection >= fault.at && !is_false_alarm);
        let named = named.find(|of| of.component == fault.component);
        let delay = named.map(|of| of.detection.since(fault.at));
        Self { found: delay, right: delay }
    }
}

/// The finding of a detector on a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum DetectionOutcome {
    Nothing,
    Found,
    Right,
}

/// The finding of a detector on a component, and whether it is final.
pub(super) fn outcome(
    rig: &Rig,
    path: &ComponentPath,
    detector: LimitDetector,
) -> (DetectionOutcome, bool) {
    let nothing = (DetectionOutcome::Nothing, false);
    let of_module = |d: &&diagnosis::Diagnoser| *d.module() == path.module;
    let Some(diagnoser) = rig.diagnosers().iter().find(of_module) else { return nothing };
    let mut all = diagnoser.verdicts().zip(diagnoser.conditions());
    let component = all.find(|((component, _), _)| **component == path.component);
    let Some(((component, verdict), condition)) = component else { return nothing };
    let outcome = match detector {
        LimitDetector::Change | LimitDetector::Isolation => {
            let symptom = diagnoser.last_transition(component).map(|latest| latest.symptom);
            by_change(verdict, symptom)
        }
        LimitDetector::Reference => by_standing(standing(path, verdict, condition)),
    };
    (outcome, verdict.is_latched())
}

fn by_change(verdict: &Verdict, symptom: Option<Symptom>) -> DetectionOutcome {
    match (verdict, symptom) {
        (
            _,
            Some(Symptom::Departure | Symptom::OilContent | Symptom::Scatter | Symptom::Reading)
            | None,
        )
        | (Verdict::Normal | Verdict::Unknown | Verdict::Explained { .. }, _) => {
            DetectionOutcome::Nothing
        }
        (Verdict::Tentative | Verdict::Unconfirmed { .. }, _) => DetectionOutcome::Found,
        (Verdict::Latched | Verdict::Acknowledged, _) => DetectionOutcome::Right,
    }
}

fn by_standing(standing: Standing) -> DetectionOutcome {
    match standing {
        Standing::Named | Standing::Likeliest => DetectionOutcome::Right,
        Standing::InAGroup => DetectionOutcome::Found,
        Standing::CannotTell | Standing::Normal => DetectionOutcome::Nothing,
    }
}

/// Since when a condition has held without interruption; a retracted finding does not count.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Since(Option<Step>);

impl Since {
    pub(super) fn note(&mut self, step: Step, is_so: bool) {
        self.0 = if is_so { self.0.or(Some(step)) } else { None };
    }

    /// Steps from `at` on; `None` if the condition does not hold, or held before.
    pub(super) fn steps_from(self, at: Step) -> Option<u64> {
        self.0.filter(|since| *since >= at).map(|since| since.since(at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_back_or_was_so_before_does_not_count() {
        let since = |so: &[bool]| {
            let mut since = Since::default();
            so.iter().zip(0..).for_each(|(is_so, step)| since.note(Step(step), *is_so));
            since.steps_from(Step(2))
        };
        assert_eq!(since(&[false, false, true, true]), Some(0));
        assert_eq!(since(&[false, false, true, false, true]), Some(2));
        assert_eq!(since(&[false, false, true, false]), None);
        assert_eq!(since(&[false, true, true, true]), None);
    }
}
