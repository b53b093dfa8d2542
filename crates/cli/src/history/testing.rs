//! Made-up journals for tests.

use names::Step;
use observer::ModuleHistory;
use wire::{FaultState, FaultTransition, GivenOrder, GivenOrderKind};

/// A journal that holds everything up to its last transition.
pub(crate) fn history(module: &str, transitions: Vec<FaultTransition>) -> ModuleHistory {
    ModuleHistory {
        structure: "tower".parse().unwrap(),
        module: module.parse().unwrap(),
        first_sequence: transitions.first().map(|transition| transition.sequence),
        next_sequence: Some(transitions.last().map_or(1, |transition| transition.sequence + 1)),
        transitions,
        identifications: Vec::new(),
        broken_off: None,
    }
}

pub(crate) fn transition(module: &str, sequence: u64, time_unix_ns: u64) -> FaultTransition {
    let component = format!("{module}/sensor/g1").parse().unwrap();
    FaultTransition {
        verdict: wire::Verdict::example(FaultState::Latched),
        sequence,
        decided_step: Some(Step(7)),
        ..FaultTransition::untouched("tower".parse().unwrap(), component, time_unix_ns)
    }
}

/// An acknowledged fault, a second later.
pub(crate) fn acknowledged(module: &str, sequence: u64) -> FaultTransition {
    let order = GivenOrder {
        kind: GivenOrderKind::Acknowledge,
        on_behalf_of: None,
        by: "ada@station".to_owned(),
        note: Some("looks loose".to_owned()),
    };
    FaultTransition {
        verdict: wire::Verdict::example(FaultState::Acknowledged),
        order: Some(order),
        ..transition(module, sequence, 1_000_000_000)
    }
}
