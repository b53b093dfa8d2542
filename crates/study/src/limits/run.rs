//! A commissioned plant goes through a run: when is its fault found, and when is the right component known?

use diagnosis::{Symptom, Verdict};
use names::{ComponentPath, RunId, Step};

use super::curve::Detector;
use super::draw::Run;
use crate::conditions::{CommissionedPlant, Standing, standing};
use crate::error::StudyError;
use crate::rig::Rig;
use crate::schedule::Schedule;

/// When it was found, and when the right component was known, in steps from the fault's first sample on, which counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Times {
    pub(super) found: Option<u64>,
    pub(super) right: Option<u64>,
}

/// What a detector has found out of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    Nothing,
    Found,
    Right,
}

/// Goes through a run until its component is declared faulty, which it then stays.
pub(super) fn go_through(
    plants: &[CommissionedPlant],
    run: &Run,
    detector: Detector,
) -> Result<Times, StudyError> {
    let CommissionedPlant { site, setups, .. } = &plants[run.plant];
    let (at, path) = (run.injection.at, &run.injection.component);
    let schedule = Schedule::new(vec![run.injection.clone()]);
    let mut rig = Rig::new(site.plant(run.seed)?, setups.clone(), schedule, RunId(run.seed))?;
    let (mut found, mut right) = (Since::default(), Since::default());
    for step in (0..run.steps).map(Step) {
        rig.step()?;
        let (outcome, is_final) = outcome(&rig, path, detector);
        found.note(step, outcome >= Outcome::Found);
        right.note(step, outcome == Outcome::Right);
        if is_final {
            break;
        }
    }
    Ok(Times { found: found.steps_from(at), right: right.steps_from(at) })
}

/// What a detector has found out of a component, and whether that will never be otherwise.
fn outcome(rig: &Rig, path: &ComponentPath, detector: Detector) -> (Outcome, bool) {
    let nothing = (Outcome::Nothing, false);
    let of_module = |d: &&diagnosis::Diagnoser| *d.module() == path.module;
    let Some(diagnoser) = rig.diagnosers().iter().find(of_module) else { return nothing };
    let mut all = diagnoser.verdicts().zip(diagnoser.conditions());
    let component = all.find(|((component, _), _)| **component == path.component);
    let Some(((component, verdict), condition)) = component else { return nothing };
    let outcome = match detector {
        Detector::Change => {
            let symptom = diagnoser.last_transition(component).map(|latest| latest.symptom);
            by_change(verdict, symptom)
        }
        Detector::Reference => by_standing(standing(path, verdict, condition)),
    };
    (outcome, verdict.is_latched())
}

fn by_change(verdict: &Verdict, symptom: Option<Symptom>) -> Outcome {
    match (verdict, symptom) {
        (_, Some(Symptom::Departure | Symptom::OilContent | Symptom::Scatter) | None)
        | (Verdict::Normal | Verdict::Unknown | Verdict::Explained { .. }, _) => Outcome::Nothing,
        (Verdict::Tentative | Verdict::Unconfirmed { .. }, _) => Outcome::Found,
        (Verdict::Latched | Verdict::Acknowledged, _) => Outcome::Right,
    }
}

fn by_standing(standing: Standing) -> Outcome {
    match standing {
        Standing::Named | Standing::Likeliest => Outcome::Right,
        Standing::InAGroup => Outcome::Found,
        Standing::CannotTell | Standing::Normal => Outcome::Nothing,
    }
}

/// Since when something has been so without a break: what is taken back does not count.
#[derive(Debug, Clone, Copy, Default)]
struct Since(Option<Step>);

impl Since {
    fn note(&mut self, step: Step, is_so: bool) {
        self.0 = if is_so { self.0.or(Some(step)) } else { None };
    }

    /// Steps from `at` on, itself included; `None` if it is not so, or was so before.
    fn steps_from(self, at: Step) -> Option<u64> {
        self.0.filter(|since| *since >= at).map(|since| since.since(at) + 1)
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
        assert_eq!(since(&[false, false, true, true]), Some(1));
        assert_eq!(since(&[false, false, true, false, true]), Some(3));
        assert_eq!(since(&[false, false, true, false]), None);
        assert_eq!(since(&[false, true, true, true]), None);
    }
}
