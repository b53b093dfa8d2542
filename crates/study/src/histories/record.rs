//! What came of a history.

use std::collections::BTreeSet;

use diagnosis::Verdict;
use names::{ComponentPath, Step};
use serde::Serialize;

use super::draw::History;
use super::pattern::Pattern;
use crate::rig::Occurrence;

/// A component that was named as faulty.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Named {
    /// The component.
    pub component: ComponentPath,
    /// When its divergence reached its threshold.
    pub detection: Step,
    /// As of which step the verdict was found.
    pub decided: Step,
    /// It had never been faulty by then. A fault that begins while a change is held is one of those it is judged by.
    pub healthy: bool,
}

/// What came of a history.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HistoryRecord {
    /// Its number.
    pub number: u64,
    /// Seed of its plant.
    pub seed: u64,
    /// How its faults follow each other.
    pub pattern: Pattern,
    /// Its faulty components in the order in which they became so, and whether they were named.
    pub faulty: Vec<(ComponentPath, bool)>,
    /// What was named, in order.
    pub named: Vec<Named>,
    /// Changes that could not be judged in the end.
    pub unconfirmed: u64,
    /// Was no diagnoser disturbed?
    pub undisturbed: bool,
}

impl HistoryRecord {
    pub(super) fn of(history: &History, occurrences: &[Occurrence], unconfirmed: u64) -> Self {
        let named: Vec<Named> = occurrences.iter().filter_map(|o| named(history, o)).collect();
        let mut seen = BTreeSet::new();
        let order = history.injections.iter().map(|injection| &injection.component);
        let faulty = order.filter(|component| seen.insert((*component).clone()));
        let is_named = |component: &ComponentPath| {
            named.iter().any(|named| named.component == *component && !named.healthy)
        };
        Self {
            number: history.number,
            seed: history.seed,
            pattern: history.pattern,
            faulty: faulty.map(|component| (component.clone(), is_named(component))).collect(),
            unconfirmed,
            undisturbed: history.disturbances.is_empty(),
            named,
        }
    }

    /// What was named and had never been faulty.
    pub fn healthy(&self) -> impl Iterator<Item = &Named> {
        self.named.iter().filter(|named| named.healthy)
    }
}

fn named(history: &History, occurrence: &Occurrence) -> Option<Named> {
    let Occurrence::Transition { module, transition } = occurrence else { return None };
    if transition.verdict != Verdict::Latched || transition.order.is_some() {
        return None;
    }
    let component =
        ComponentPath { module: module.clone(), component: transition.component.clone() };
    let (detection, decided) = (transition.detection, transition.decided);
    let healthy = !history.was_faulty(&component, decided);
    Some(Named { component, detection, decided, healthy })
}
