//! Made-up scenes for tests.

use observer::{ModuleView, NetworkState, Scene};
use vocabulary::{
    Condition, FaultState, FaultTransition, GivenOrder, GivenOrderKind, ModuleStatus, RunId,
    Shelving, Step, Unknown,
};

/// When the scenes were made \[ns since 1970\].
pub(crate) const NOW_NS: u64 = 1_795_000_000_000_000_000;

/// A component of the tower in this state, which agrees with its reference if it is normal.
pub(crate) fn component(path: &str, state: FaultState) -> FaultTransition {
    let untouched =
        FaultTransition::untouched("tower".parse().unwrap(), path.parse().unwrap(), NOW_NS);
    let condition = Some(match state {
        FaultState::Normal => {
            Condition::Agrees { from: vocabulary::Step(1), as_of: vocabulary::Step(9) }
        }
        _ => Condition::CannotTell { obstacle: vocabulary::Obstacle::Swinging },
    });
    FaultTransition { verdict: vocabulary::Verdict::example(state), condition, ..untouched }
}

/// A latched fault with an onset.
pub(crate) fn latched(path: &str) -> FaultTransition {
    FaultTransition {
        sequence: 3,
        run: Some(RunId(1)),
        onset_step: Some(Step(1234)),
        decided_step: Some(Step(1240)),
        ..component(path, FaultState::Latched)
    }
}

/// The same, acknowledged with a note.
pub(crate) fn acknowledged(path: &str, note: &str) -> FaultTransition {
    let order = GivenOrder {
        kind: GivenOrderKind::Acknowledge,
        by: "web".to_owned(),
        on_behalf_of: Some("ada".to_owned()),
        note: Some(note.to_owned()),
    };
    FaultTransition {
        verdict: vocabulary::Verdict::example(FaultState::Acknowledged),
        order: Some(order),
        ..latched(path)
    }
}

/// An alarm that is set aside.
pub(crate) fn shelving(reason: &str) -> Shelving {
    Shelving {
        since_unix_ns: NOW_NS,
        until_unix_ns: NOW_NS + 3_600_000_000_000,
        by: "ada".to_owned(),
        on_behalf_of: None,
        reason: reason.to_owned(),
    }
}

/// A status of a module of the tower, in service.
pub(crate) fn status(module: &str) -> ModuleStatus {
    let waiting = ModuleStatus::waiting("tower".parse().unwrap(), module.parse().unwrap());
    ModuleStatus {
        phase: vocabulary::ModulePhase::InService,
        in_service_since_step: Some(vocabulary::Step(1)),
        run: Some(vocabulary::RunId(1)),
        step: Some(vocabulary::Step(9)),
        lag_ms: Some(1.0),
        time_unix_ns: NOW_NS,
        ..waiting
    }
}

/// A module that is heard and in service.
pub(crate) fn module(name: &str, components: Vec<FaultTransition>) -> ModuleView {
    let view = ModuleView::new(Some("tower".parse().unwrap()), name.parse().unwrap());
    let status = Some(status(name));
    ModuleView { present: true, status, components, heard_unix_ns: NOW_NS, ..view }
}

/// The same when it is not heard any more.
pub(crate) fn silent(mut module: ModuleView) -> ModuleView {
    let heard_unix_ns = NOW_NS - 9_000_000_000;
    let reason = "its diagnoser is not heard".to_owned();
    let unknown = Unknown { since_unix_ns: heard_unix_ns, reason };
    for component in &mut module.components {
        *component = component.clone().while_unknown(unknown.clone());
        component.condition = None;
    }
    ModuleView { is_silent: true, heard_unix_ns, ..module }
}

/// A scene of these modules, with a network.
pub(crate) fn scene(modules: Vec<ModuleView>) -> Scene {
    Scene {
        number: 1,
        time_unix_ns: NOW_NS,
        network: NetworkState::Open,
        modules,
        ..Scene::default()
    }
}
