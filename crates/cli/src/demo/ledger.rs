//! Which faults were named, and whether they are the injected ones.

use std::collections::BTreeMap;

use names::{ComponentPath, Step};
use wire::{Candidate, FaultState, FaultTransition, Identification};

use super::entry::{DiagnosedFault, InjectedFault, Summary};
use super::story::Act;

/// The faults that were named, each with the transition that named it first, and their kinds.
#[derive(Debug, Clone, Default)]
pub(super) struct Ledger {
    named: BTreeMap<ComponentPath, FaultTransition>,
    kinds: BTreeMap<ComponentPath, Candidate>,
}

impl Ledger {
    /// Takes a transition into account.
    pub(super) fn take(&mut self, transition: &FaultTransition) {
        if transition.state() == FaultState::Latched {
            self.named.entry(transition.component.clone()).or_insert_with(|| transition.clone());
        }
    }

    /// Takes a kind into account if it was decided while the fault was there. Returns it if it is another one than before.
    pub(super) fn identified(&mut self, found: &Identification, acts: &[Act]) -> Option<Candidate> {
        let component = &found.component;
        let repaired = acts.iter().find(|act| act.story.component == *component)?.repaired;
        let kind = found.kind().filter(|_| found.as_of_step < repaired)?;
        let before = self.kinds.insert(component.clone(), kind.clone());
        before.is_none_or(|before| before.kind != kind.kind).then(|| kind.clone())
    }

    /// What was injected against what was named.
    pub(super) fn summary(&self, acts: &[Act], step_s: f64, pids: Vec<u32>) -> Summary {
        let mut diagnosed: Vec<DiagnosedFault> = self
            .named
            .values()
            .map(|transition| self.diagnosed(transition, acts, step_s))
            .collect();
        diagnosed.sort_by_key(|fault| fault.detection_step);
        let exact =
            self.named.len() == acts.len() && acts.iter().all(|act| self.is_named_in_time(act));
        Summary { injected: acts.iter().map(injected).collect(), diagnosed, exact, pids }
    }

    /// Named while it was there.
    fn is_named_in_time(&self, act: &Act) -> bool {
        let named = self.named.get(&act.story.component);
        let detected = named.and_then(|transition| transition.detection_step);
        detected.is_some_and(|step| (act.injected..act.repaired).contains(&step))
    }

    fn diagnosed(&self, transition: &FaultTransition, acts: &[Act], step_s: f64) -> DiagnosedFault {
        let act = acts.iter().find(|act| act.story.component == transition.component);
        let delay_ms = |step: Option<Step>| {
            let (step, injected) = (step?, act?.injected);
            // Rounded to the microsecond: steps are whole milliseconds, their product is not quite.
            let ms = step.0.checked_sub(injected.0)? as f64 * step_s * 1e3;
            Some((ms * 1e3).round() / 1e3)
        };
        DiagnosedFault {
            component: transition.component.clone(),
            onset_step: transition.onset_step,
            detection_step: transition.detection_step,
            decided_step: transition.decided_step,
            delay_ms: delay_ms(transition.detection_step),
            verdict_delay_ms: delay_ms(transition.decided_step),
            identified: self.kinds.get(&transition.component).cloned(),
        }
    }
}

fn injected(act: &Act) -> InjectedFault {
    InjectedFault {
        component: act.story.component.clone(),
        fault: act.story.fault,
        step: act.injected,
        repaired_step: act.repaired,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::testing::{acts, transition};
    use crate::faults::testing::identification;

    fn exact(transitions: &[(&str, u64)]) -> bool {
        let mut ledger = Ledger::default();
        for &(component, step) in transitions {
            ledger.take(&transition(component, FaultState::Latched, step));
        }
        ledger.summary(&acts(), 1e-3, vec![1]).exact
    }

    #[test]
    fn exact_is_every_fault_in_its_time_and_nothing_else() {
        assert!(exact(&[("m1/sensor/g1", 105), ("m2/actuator/a1", 1000)]));
        for wrong in [
            &[][..],
            &[("m1/sensor/g1", 105)],
            &[("m1/sensor/g1", 99), ("m2/actuator/a1", 1000)],
            &[("m1/sensor/g1", 115), ("m2/actuator/a1", 1000)],
            &[("m1/sensor/g1", 105), ("m2/actuator/a2", 1000)],
            &[("m1/sensor/g1", 105), ("m2/actuator/a1", 1000), ("m1/sensor/g2", 1200)],
        ] {
            assert!(!exact(wrong), "{wrong:?}");
        }
    }

    #[test]
    fn a_kind_counts_if_it_was_decided_before_the_repair_and_is_news_once() {
        let found = |kind: &str, step, decided| Identification {
            as_of_step: Step(step),
            component: "m1/sensor/g1".parse().unwrap(),
            ..identification(decided, &[kind])
        };
        let mut ledger = Ledger::default();
        ledger.take(&transition("m1/sensor/g1", FaultState::Latched, 105));
        let mut news = |kind, step, decided| {
            let news = ledger.identified(&found(kind, step, decided), &acts());
            news.map(|candidate| candidate.kind)
        };
        assert_eq!(news("bias", 104, false), None);
        assert_eq!(news("bias", 105, true).as_deref(), Some("bias"));
        assert_eq!(news("bias", 106, true), None);
        assert_eq!(news("zero_output", 110, true).as_deref(), Some("zero_output"));
        assert_eq!(news("intermittent", 115, true), None);
        let summary = ledger.summary(&acts(), 1e-3, vec![]);
        let kind = summary.diagnosed[0].identified.as_ref().map(|found| found.kind.as_str());
        assert_eq!(kind, Some("zero_output"));
    }

    #[test]
    fn only_the_first_latching_counts_and_other_states_do_not() {
        let mut ledger = Ledger::default();
        ledger.take(&transition("m1/sensor/g2", FaultState::Explained, 100));
        ledger.take(&transition("m1/sensor/g1", FaultState::Latched, 103));
        ledger.take(&transition("m1/sensor/g1", FaultState::Latched, 900));
        let summary = ledger.summary(&acts(), 1e-3, vec![]);
        assert_eq!(summary.diagnosed.len(), 1);
        assert_eq!(summary.diagnosed[0].delay_ms, Some(3.0));
    }
}
