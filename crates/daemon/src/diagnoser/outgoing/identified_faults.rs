//! The present fault of each component with its identification, for those who ask and for the transitions that follow.

use std::collections::BTreeMap;
use std::sync::Arc;

use vocabulary::{Component, FaultTransition, Identification, Topic};
use zenoh::key_expr::KeyExpr;

use super::event_lane::Outgoing;
use crate::diagnoser::identification::{IdentificationTally, PresentFault};
use diagnosis::messages::Speaker;

/// The present fault of each component, if it has one.
#[derive(Debug)]
pub(crate) struct IdentifiedFaults {
    pages: Vec<Page>,
    tally: Arc<IdentificationTally>,
}

#[derive(Debug)]
struct Page {
    component: Component,
    key: String,
    fault: PresentFault,
}

impl IdentifiedFaults {
    /// `recalled`: the faults from before the restart.
    pub(crate) fn new(
        speaker: &Speaker,
        components: &[Component],
        mut recalled: BTreeMap<Component, PresentFault>,
        tally: Arc<IdentificationTally>,
    ) -> Self {
        let page = |component: &Component| Page {
            component: component.clone(),
            key: speaker.key(Topic::Identification(component.clone())),
            fault: recalled.remove(component).unwrap_or_default(),
        };
        let pages = components.iter().map(page).collect();
        let faults = Self { pages, tally };
        faults.tell();
        faults
    }

    /// Takes note of what goes out: a transition gets the identification of its fault, and an identification that says
    /// nothing new, or is of a fault that is no longer there, goes no further.
    pub(super) fn note(&mut self, event: Outgoing) -> Option<Outgoing> {
        match event {
            Outgoing::Fault(mut transition) => {
                self.enter(&mut transition);
                Some(Outgoing::Fault(transition))
            }
            Outgoing::Identification(found) => {
                let page = self.page(&found.component.component)?;
                let published = page.fault.find(*found);
                self.tell();
                published.map(|published| Outgoing::Identification(Box::new(published)))
            }
            other => Some(other),
        }
    }

    fn enter(&mut self, transition: &mut FaultTransition) {
        let Some(page) = self.page(&transition.component.component) else { return };
        page.fault.enter(transition);
        transition.identification = page.fault.latest().map(carried);
        self.tell();
    }

    /// A component's state with what is known of its fault at present.
    pub(super) fn completed(&self, state: FaultTransition) -> FaultTransition {
        let component = &state.component.component;
        let page = self.pages.iter().find(|page| page.component == *component);
        let latest = page.filter(|_| state.state().is_fault()).and_then(|page| page.fault.latest());
        FaultTransition { identification: latest.map(carried), ..state }
    }

    /// What was published last of each present fault.
    pub(super) fn published(&self) -> Vec<Identification> {
        self.pages.iter().filter_map(|page| page.fault.published().cloned()).collect()
    }

    /// The latest of those components whose key the expression asked for covers.
    pub(super) fn covered_by(&self, expression: &KeyExpr<'_>) -> Vec<(&str, &Identification)> {
        let covered = self.pages.iter().filter(|page| {
            KeyExpr::try_from(page.key.as_str()).is_ok_and(|key| expression.intersects(&key))
        });
        covered.filter_map(|page| Some((page.key.as_str(), page.fault.latest()?))).collect()
    }

    /// One of those that `note` let pass has been published.
    pub(super) fn count_published(&self) {
        self.tally.published();
    }

    fn page(&mut self, component: &Component) -> Option<&mut Page> {
        self.pages.iter_mut().find(|page| page.component == *component)
    }

    fn tell(&self) {
        self.tally.know(self.pages.iter().filter_map(|page| page.fault.latest()));
    }
}

/// What a transition carries of the latest identification.
fn carried(latest: &Identification) -> Box<Identification> {
    Box::new(latest.clone().without_signature())
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::identification::{Candidate, Identification as Found, SignaturePoint};
    use vocabulary::{FaultState, RunId, Step, fault::FaultKind};

    fn speaker() -> Speaker {
        Speaker::of("tower".parse().unwrap(), "module1".parse().unwrap())
    }

    fn faults() -> (IdentifiedFaults, Arc<IdentificationTally>) {
        let names = ["actuator/a1", "sensor/g1", "sensor/g2"];
        let components: Vec<Component> = names.iter().map(|name| name.parse().unwrap()).collect();
        let tally = Arc::new(IdentificationTally::default());
        let recalled = BTreeMap::new();
        (IdentifiedFaults::new(&speaker(), &components, recalled, Arc::clone(&tally)), tally)
    }

    fn transition(sequence: u64, state: FaultState) -> Outgoing {
        let untouched = speaker().untouched(&"sensor/g2".parse().unwrap(), 0);
        Outgoing::Fault(Box::new(FaultTransition {
            sequence,
            verdict: vocabulary::Verdict::example(state),
            ..untouched
        }))
    }

    fn stuck(sequence: u64, as_of: u64) -> Outgoing {
        let found = Found {
            run: RunId(1),
            sequence,
            component: "sensor/g2".parse().unwrap(),
            as_of: Step(as_of),
            candidates: vec![Candidate { kind: FaultKind::Stuck, probability: 0.99, size: None }],
            signature: vec![SignaturePoint { step: Step(as_of), measured: 1.0, fitted: 2.0 }],
        };
        Outgoing::Identification(Box::new(speaker().identification(found, 0)))
    }

    fn latest(faults: &IdentifiedFaults, expression: &str) -> Vec<(String, u64, bool)> {
        let expression = KeyExpr::try_from(expression).unwrap();
        let found = faults.covered_by(&expression).into_iter();
        found.map(|(key, i)| (key.to_owned(), i.as_of_step.0, i.signature.is_some())).collect()
    }

    #[test]
    fn a_transition_after_an_identification_carries_it_without_the_signature() {
        let (mut faults, _) = faults();
        let Some(Outgoing::Fault(first)) = faults.note(transition(1, FaultState::Latched)) else {
            unreachable!("a transition goes on")
        };
        assert_eq!(first.identification, None);
        assert!(faults.note(stuck(1, 50)).is_some());
        assert!(faults.note(stuck(1, 60)).is_none(), "no news");
        let Some(Outgoing::Fault(next)) = faults.note(transition(2, FaultState::Acknowledged))
        else {
            unreachable!("a transition goes on")
        };
        let carried = next.identification.unwrap();
        assert_eq!((carried.as_of_step, carried.signature), (Step(60), None));
        let state = FaultTransition { identification: None, ..*first };
        assert_eq!(faults.completed(state).identification.unwrap().as_of_step, Step(60));
    }

    #[test]
    fn questions_are_answered_with_the_latest_of_what_they_cover() {
        let (mut faults, _) = faults();
        assert_eq!(latest(&faults, "trusswatch/**"), []);
        faults.note(transition(1, FaultState::Latched));
        faults.note(stuck(1, 50));
        faults.note(stuck(1, 60));
        let key = "trusswatch/tower/module1/identification/sensor/g2";
        let one = [(key.to_owned(), 60, true)];
        assert_eq!(latest(&faults, "trusswatch/*/*/identification/**"), one);
        assert_eq!(latest(&faults, key), one);
        assert_eq!(latest(&faults, "trusswatch/*/*/identification/actuator/*"), []);
        faults.note(transition(2, FaultState::Normal));
        assert_eq!(latest(&faults, key), []);
    }

    #[test]
    fn the_metrics_know_the_kinds_of_present_faults_only() {
        let (mut faults, tally) = faults();
        faults.note(transition(1, FaultState::Latched));
        faults.note(stuck(1, 50));
        let kinds = tally.read().kinds;
        assert_eq!((kinds.len(), kinds[0].kind.as_str()), (1, "stuck"));
        faults.note(transition(2, FaultState::Normal));
        assert_eq!(tally.read().kinds, []);
    }
}
