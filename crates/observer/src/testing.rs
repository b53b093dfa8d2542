//! Made-up messages and views, for tests: of this crate and of those who lay views out.

#![expect(clippy::unwrap_used, reason = "names that are right")]

use std::collections::BTreeMap;

use vocabulary::{
    Candidate, Condition, FaultState, FaultTransition, GivenOrder, GivenOrderKind, Identification,
    IdentifiedKind, ModulePhase, ModuleStatus, PeerStatus, PhaseChange, RunId, Shelving, Step,
    fault::FaultKind,
};

use crate::view::{ModuleHistory, ModuleView, NetworkState, Scene};

/// A status of a module of the tower that names these peers.
#[must_use]
pub fn status(module: &str, peers: &[&str]) -> ModuleStatus {
    let waiting = ModuleStatus::waiting("tower".parse().unwrap(), module.parse().unwrap());
    ModuleStatus {
        phase: ModulePhase::InService,
        in_service_since_step: Some(Step(1)),
        run: Some(RunId(1)),
        step: Some(Step(9)),
        lag_ms: Some(1.0),
        peers: peers.iter().map(|peer| PeerStatus::unasked(peer.parse().unwrap())).collect(),
        time_unix_ns: 5,
        ..waiting
    }
}

/// Module `m1` of the tower enters this phase.
#[must_use]
pub fn phase_change(phase: ModulePhase, time_unix_ns: u64) -> PhaseChange {
    PhaseChange {
        structure: "tower".parse().unwrap(),
        module: "m1".parse().unwrap(),
        phase,
        number: 1,
        not_monitored: BTreeMap::new(),
        before: None,
        run: None,
        step: None,
        reason: String::new(),
        time_unix_ns,
    }
}

/// A component of the tower in a state since 1970-01-01T00:00:01Z.
#[must_use]
pub fn state(component: &str, state: FaultState) -> FaultTransition {
    let (structure, component) = ("tower".parse().unwrap(), component.parse().unwrap());
    let verdict = vocabulary::Verdict::example(state);
    FaultTransition { verdict, ..FaultTransition::untouched(structure, component, 1_000_000_000) }
}

/// A module of the tower in this phase that answers.
#[must_use]
pub fn module(name: &str, phase: ModulePhase, components: Vec<FaultTransition>) -> ModuleView {
    let view = mute(name, None);
    let status = ModuleStatus { phase, ..status(name, &[]) };
    ModuleView { present: true, status: Some(status), heard_unix_ns: 1, components, ..view }
}

/// A module of the tower that does not answer.
#[must_use]
pub fn mute(name: &str, peer_of: Option<&str>) -> ModuleView {
    let peer_of = peer_of.iter().map(|name| name.parse().unwrap()).collect();
    let structure = Some("tower".parse().unwrap());
    ModuleView { peer_of, ..ModuleView::new(structure, name.parse().unwrap()) }
}

/// The same in another structure.
#[must_use]
pub fn at(structure: &str, mut module: ModuleView) -> ModuleView {
    module.structure = Some(structure.parse().unwrap());
    for component in &mut module.components {
        component.structure = structure.parse().unwrap();
    }
    module
}

/// A scene of these modules, with a network.
#[must_use]
pub fn scene(modules: Vec<ModuleView>) -> Scene {
    Scene { network: NetworkState::Open, modules, ..Scene::default() }
}

/// Its alarm is shelved by an operator.
#[must_use]
pub fn shelved(state: FaultTransition) -> FaultTransition {
    FaultTransition { shelved: Some(shelving("the gage is being rewired")), ..state }
}

/// Its alarm is suppressed while its module is maintained.
#[must_use]
pub fn suppressed(state: FaultTransition) -> FaultTransition {
    FaultTransition { suppressed: Some(shelving("painting")), ..state }
}

fn shelving(reason: &str) -> Shelving {
    Shelving {
        since_unix_ns: 1_000_000_000,
        until_unix_ns: 7_200_000_000_000,
        by: "ada".to_owned(),
        on_behalf_of: None,
        reason: reason.to_owned(),
    }
}

/// It agrees with its reference.
#[must_use]
pub fn agreeing(state: FaultTransition) -> FaultTransition {
    let condition = Condition::Agrees { from: Step(1), as_of: Step(9) };
    FaultTransition { condition: Some(condition), ..state }
}

/// A kind of fault of the gage `m1/sensor/g2`, without sizes.
#[must_use]
pub fn identification(decided: bool, kinds: &[&str]) -> Identification {
    let candidate = |kind: &&str| {
        let probability = if decided { 0.987 } else { 0.5 };
        let known = FaultKind::named(kind).map(IdentifiedKind::Known);
        let kind = known.unwrap_or(IdentifiedKind::NoneOfThese);
        Candidate { kind, probability, size: None }
    };
    Identification {
        structure: "tower".parse().unwrap(),
        module: "m1".parse().unwrap(),
        component: "m1/sensor/g2".parse().unwrap(),
        run: RunId(1),
        sequence: 1,
        as_of_step: Step(142),
        decided,
        candidates: kinds.iter().map(candidate).collect(),
        signature: None,
        since_unix_ns: None,
        time_unix_ns: 1_100_000_000,
    }
}

/// A journal that holds everything up to its last transition.
#[must_use]
pub fn history(module: &str, transitions: Vec<FaultTransition>) -> ModuleHistory {
    let empty = ModuleHistory::new(&"tower".parse().unwrap(), &module.parse().unwrap(), 1);
    ModuleHistory {
        first_sequence: transitions.first().map(|transition| transition.sequence),
        next_sequence: Some(transitions.last().map_or(1, |transition| transition.sequence + 1)),
        transitions,
        ..empty
    }
}

/// A latched fault of a module's gage `g1`, decided as of step 7.
#[must_use]
pub fn journaled(module: &str, sequence: u64, time_unix_ns: u64) -> FaultTransition {
    FaultTransition {
        sequence,
        time_unix_ns,
        decided_step: Some(Step(7)),
        ..state(&format!("{module}/sensor/g1"), FaultState::Latched)
    }
}

/// The same a second later, acknowledged.
#[must_use]
pub fn acknowledged(module: &str, sequence: u64) -> FaultTransition {
    let order = GivenOrder {
        kind: GivenOrderKind::Acknowledge,
        on_behalf_of: None,
        by: "ada@station".to_owned(),
        note: Some("looks loose".to_owned()),
    };
    let latched = journaled(module, sequence, 1_000_000_000);
    FaultTransition { verdict: vocabulary::Verdict::Acknowledged, order: Some(order), ..latched }
}
