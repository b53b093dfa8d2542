//! The verdicts of a run, as a figure reports them.

use std::collections::BTreeMap;

use diagnosis::{Transition, Verdict};
use vocabulary::{ComponentKind, ComponentPath, ModuleName, Step};

use crate::group::RigEvent;
use crate::trace::RunTrace;

/// A verdict on a component that changed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FigureVerdict {
    /// The component.
    pub(super) component: ComponentPath,
    /// When its divergence reached its threshold.
    pub(super) detection: Step,
    /// When the verdict was reached.
    pub(super) decided: Step,
    /// D/γ at the detection.
    pub(super) ratio: f64,
    /// The component that explains the change; `None` if the changed component itself was named.
    pub(super) by: Option<ComponentPath>,
}

/// All components named or explained, in order.
pub(super) fn findings(trace: &RunTrace) -> Vec<FigureVerdict> {
    trace.occurrences.iter().filter_map(verdict).collect()
}

fn verdict(occurrence: &RigEvent) -> Option<FigureVerdict> {
    let RigEvent::Transition { module, transition } = occurrence else { return None };
    let by = match &transition.verdict {
        Verdict::Latched => None,
        Verdict::Explained { by, .. } => Some(by.clone()),
        Verdict::Normal
        | Verdict::Tentative
        | Verdict::Unconfirmed { .. }
        | Verdict::Acknowledged
        | Verdict::Unknown => return None,
    };
    let Transition { component, detection, decided, evidence, .. } = transition.as_ref();
    Some(FigureVerdict {
        component: ComponentPath { module: module.clone(), component: component.clone() },
        detection: *detection,
        decided: *decided,
        ratio: evidence.ratio(),
        by,
    })
}

/// The outcome for the channels of one kind in one module, e.g. `5 of 8 change, explained by module1/actuator/a3`.
pub(super) fn summary(
    findings: &[FigureVerdict],
    module: &ModuleName,
    kind: ComponentKind,
    channels: usize,
) -> String {
    // Only the latest verdict on each component counts.
    let mut latest: BTreeMap<&ComponentPath, &FigureVerdict> = BTreeMap::new();
    for verdict in findings {
        let path = &verdict.component;
        if path.module == *module && path.component.kind() == kind {
            latest.insert(path, verdict);
        }
    }
    let mut parts = vec![match latest.len() {
        0 => format!("none of the {channels} changes"),
        1 => format!("1 of {channels} changes"),
        changed => format!("{changed} of {channels} change"),
    }];
    let named: Vec<&str> = (latest.iter())
        .filter(|(_, verdict)| verdict.by.is_none())
        .map(|(path, _)| path.component.name())
        .collect();
    if !named.is_empty() {
        parts.push(format!("named as faulty: {}", named.join(", ")));
    }
    let mut explained: BTreeMap<&ComponentPath, usize> = BTreeMap::new();
    for by in latest.values().filter_map(|verdict| verdict.by.as_ref()) {
        *explained.entry(by).or_default() += 1;
    }
    parts.extend(explained.iter().map(|(by, count)| format!("{count} explained by {by}")));
    parts.join("; ")
}
