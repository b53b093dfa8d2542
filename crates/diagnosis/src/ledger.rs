//! The verdicts on a module's components and their numbered transitions.

use truss::ids::{Component, ComponentPath, ModuleName, RunId, Step};

use crate::evidence::Evidence;
use crate::isolation::Case;
use crate::verdict::{Transition, Verdict};

/// What is held of one component.
#[derive(Debug, Clone)]
struct Entry {
    component: Component,
    verdict: Verdict,
    latest: Option<Transition>,
}

/// All verdicts of a module.
#[derive(Debug, Clone)]
pub(crate) struct Ledger {
    entries: Vec<Entry>,
    sequence: u64,
}

impl Ledger {
    pub(crate) fn new(components: &[Component]) -> Self {
        let entry = |component: &Component| Entry {
            component: component.clone(),
            verdict: Verdict::Normal,
            latest: None,
        };
        Self { entries: components.iter().map(entry).collect(), sequence: 0 }
    }

    pub(crate) fn verdict(&self, channel: usize) -> &Verdict {
        &self.entries[channel].verdict
    }

    pub(crate) fn verdicts(&self) -> impl Iterator<Item = (&Component, &Verdict)> {
        self.entries.iter().map(|entry| (&entry.component, &entry.verdict))
    }

    pub(crate) fn latest(&self, component: &Component) -> Option<&Transition> {
        self.entries.iter().find(|e| e.component == *component).and_then(|e| e.latest.as_ref())
    }

    pub(crate) fn next_sequence(&self) -> u64 {
        self.sequence + 1
    }

    /// The actuators held for faulty, with the step of the change that named them.
    pub(crate) fn latched_actuators(
        &self,
        module: &ModuleName,
    ) -> impl Iterator<Item = (ComponentPath, &Transition)> {
        let latched = self.entries.iter().filter(|entry| entry.verdict.is_latched());
        latched.filter_map(|entry| {
            let transition = entry.latest.as_ref()?;
            matches!(entry.component, Component::Actuator(_)).then(|| {
                (
                    ComponentPath { module: module.clone(), component: entry.component.clone() },
                    transition,
                )
            })
        })
    }

    /// Gives a component a new verdict on a case; `None` if it has that verdict already.
    pub(crate) fn enter(
        &mut self,
        run: RunId,
        case: &Case,
        verdict: Verdict,
        decided: Step,
    ) -> Option<Transition> {
        let record = Record { onset: case.onset, detection: case.change, evidence: case.evidence };
        self.record(run, case.channel, verdict, decided, record)
    }

    /// Returns a component to normal.
    pub(crate) fn clear(
        &mut self,
        run: RunId,
        channel: usize,
        decided: Step,
    ) -> Option<Transition> {
        let latest = self.entries[channel].latest.as_ref()?;
        let Transition { onset, detection, evidence, .. } = *latest;
        let record = Record { onset, detection, evidence };
        self.record(run, channel, Verdict::Normal, decided, record)
    }

    fn record(
        &mut self,
        run: RunId,
        channel: usize,
        verdict: Verdict,
        decided: Step,
        record: Record,
    ) -> Option<Transition> {
        let entry = &mut self.entries[channel];
        let known = entry.verdict == verdict
            && entry.latest.as_ref().is_none_or(|latest| latest.detection == record.detection);
        if known || entry.verdict.is_latched() {
            return None;
        }
        self.sequence += 1;
        let Record { onset, detection, evidence } = record;
        let transition = Transition {
            sequence: self.sequence,
            run,
            component: entry.component.clone(),
            verdict: verdict.clone(),
            onset,
            detection,
            decided,
            evidence,
        };
        entry.verdict = verdict;
        entry.latest = Some(transition.clone());
        Some(transition)
    }
}

struct Record {
    onset: Step,
    detection: Step,
    evidence: Evidence,
}
