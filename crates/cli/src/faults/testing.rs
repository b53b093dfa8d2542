//! Made-up pictures for tests.

use observer::{ModuleHistory, ModuleView, NetworkState, Scene};
use vocabulary::{
    Candidate, Condition, Evidence, FaultState, FaultTransition, GivenOrder, GivenOrderKind,
    Identification, ModulePhase, ModuleStatus, RunId, Step, Unknown, fault::FaultKind,
};

/// A scene of these modules, with a network.
pub(crate) fn scene(modules: Vec<ModuleView>) -> Scene {
    Scene { network: NetworkState::Open, modules, ..Scene::default() }
}

pub(crate) fn module(
    name: &str,
    phase: ModulePhase,
    components: Vec<FaultTransition>,
) -> ModuleView {
    let (status, heard_unix_ns) = (Some(status(name, phase)), 1);
    ModuleView { present: true, status, components, heard_unix_ns, ..silent(name, None) }
}

/// A module that does not answer.
pub(crate) fn silent(name: &str, peer_of: Option<&str>) -> ModuleView {
    let peer_of = peer_of.iter().map(|name| name.parse().unwrap()).collect();
    let structure = Some("tower".parse().unwrap());
    ModuleView { peer_of, ..ModuleView::new(structure, name.parse().unwrap()) }
}

/// The same in another structure.
pub(super) fn at(structure: &str, mut module: ModuleView) -> ModuleView {
    module.structure = Some(structure.parse().unwrap());
    module
}

pub(crate) fn state(component: &str, state: FaultState) -> FaultTransition {
    let (structure, component) = ("tower".parse().unwrap(), component.parse().unwrap());
    FaultTransition {
        verdict: vocabulary::Verdict::example(state),
        ..FaultTransition::untouched(structure, component, 1_000_000_000)
    }
}

/// It agrees with its reference.
pub(super) fn agreeing(state: FaultTransition) -> FaultTransition {
    let condition = Condition::Agrees { as_of: Step(4999) };
    FaultTransition { condition: Some(condition), ..state }
}

/// Of a module whose samples have stopped.
pub(super) fn unknown_state(component: &str) -> FaultTransition {
    let reason = "no sample for 500 ms".to_owned();
    state(component, FaultState::Normal)
        .while_unknown(Unknown { since_unix_ns: 2_000_000_000, reason })
}

/// A fault that the journal did not take.
pub(crate) fn latched(component: &str) -> FaultTransition {
    let evidence = Evidence {
        step: Step(42),
        residual: 6e-4,
        level: 0.0,
        divergence: Some(4226.0),
        threshold: 10.0,
    };
    FaultTransition {
        sequence: 1,
        onset_step: Some(Step(40)),
        detection_step: Some(Step(42)),
        decided_step: Some(Step(46)),
        evidence: Some(evidence),
        durable: false,
        ..state(component, FaultState::Latched)
    }
}

/// Of the gage `m1/sensor/g2`, as of a tenth of a second after its detection, without sizes.
pub(crate) fn identification(decided: bool, kinds: &[&str]) -> Identification {
    let candidate = |kind: &&str| {
        let probability = if decided { 0.987 } else { 0.5 };
        let kind = FaultKind::ALL.into_iter().find(|known| known.as_str() == *kind).unwrap();
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
        time_unix_ns: 1_100_000_000,
    }
}

pub(crate) fn status(name: &str, phase: ModulePhase) -> ModuleStatus {
    let waiting = ModuleStatus::waiting("tower".parse().unwrap(), name.parse().unwrap());
    ModuleStatus {
        phase,
        step: Some(Step(4711)),
        lag_ms: Some(1.2),
        sample_age_ms: Some(3.0),
        ..waiting
    }
}

/// A journal that holds everything up to its last transition.
pub(crate) fn history(module: &str, transitions: Vec<FaultTransition>) -> ModuleHistory {
    let empty = ModuleHistory::new(&"tower".parse().unwrap(), &module.parse().unwrap(), 1);
    ModuleHistory {
        first_sequence: transitions.first().map(|transition| transition.sequence),
        next_sequence: Some(transitions.last().map_or(1, |transition| transition.sequence + 1)),
        transitions,
        ..empty
    }
}

pub(crate) fn transition(module: &str, sequence: u64, time_unix_ns: u64) -> FaultTransition {
    let component = format!("{module}/sensor/g1").parse().unwrap();
    FaultTransition {
        verdict: vocabulary::Verdict::Latched,
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
        verdict: vocabulary::Verdict::Acknowledged,
        order: Some(order),
        ..transition(module, sequence, 1_000_000_000)
    }
}
