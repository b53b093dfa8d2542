//! Made-up scenes for tests.

use std::collections::BTreeSet;

use names::{RunId, Step};
use observer::{LiveModule, Member, ModulePicture, NetworkState, Scene};
use wire::{
    Agreement, Condition, FaultState, FaultTransition, GivenOrder, GivenOrderKind, ModuleStatus,
    Shelving, Unknown,
};

/// When the scenes were made \[ns since 1970\].
pub(crate) const NOW_NS: u64 = 1_795_000_000_000_000_000;

/// A component of the tower in this state, which agrees with its reference if it is normal.
pub(crate) fn component(path: &str, state: FaultState) -> FaultTransition {
    let untouched =
        FaultTransition::untouched("tower".parse().unwrap(), path.parse().unwrap(), NOW_NS);
    let agreement =
        if state == FaultState::Normal { Agreement::Agrees } else { Agreement::CannotTell };
    let condition = Some(Condition { agreement, as_of_step: None, reason: None });
    FaultTransition { verdict: wire::Verdict::example(state), condition, ..untouched }
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
        verdict: wire::Verdict::example(FaultState::Acknowledged),
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
        phase: wire::ModulePhase::InService,
        in_service_since_step: Some(names::Step(1)),
        run: Some(names::RunId(1)),
        step: Some(names::Step(9)),
        lag_ms: Some(1.0),
        time_unix_ns: NOW_NS,
        ..waiting
    }
}

/// A module that is heard and in service.
pub(crate) fn module(name: &str, components: Vec<FaultTransition>) -> LiveModule {
    let member = Member {
        structure: Some("tower".parse().unwrap()),
        module: name.parse().unwrap(),
        present: true,
        status: Some(status(name)),
        phase_change: None,
        expected: false,
        peer_of: BTreeSet::new(),
    };
    let picture = ModulePicture { member, components, processes: BTreeSet::new() };
    LiveModule { picture, silent_since_unix_ns: None }
}

/// The same when it is not heard any more.
pub(crate) fn silent(mut module: LiveModule) -> LiveModule {
    let since_unix_ns = NOW_NS - 9_000_000_000;
    let unknown = Unknown { since_unix_ns, reason: "its diagnoser is not heard".to_owned() };
    for component in &mut module.picture.components {
        *component = component.clone().while_unknown(unknown.clone());
    }
    module.silent_since_unix_ns = Some(since_unix_ns);
    module
}

/// A scene of these modules, with a network.
pub(crate) fn scene(modules: Vec<LiveModule>) -> Scene {
    Scene {
        number: 1,
        time_unix_ns: NOW_NS,
        network: NetworkState::Open,
        modules,
        ..Scene::default()
    }
}
