//! Made-up scenes for the tests of this crate.

use std::time::Duration;

use observer::{ModuleView, NetworkState, Scene};
use vocabulary::{Evidence, FaultState, FaultTransition, ModuleStatus, Step};

use crate::{OrderIssuer, ViewSettings};

pub(crate) const SECOND: u64 = 1_000_000_000;
/// 2026-11-21T10:00:00Z.
pub(crate) const NOW: u64 = 1_795_255_200 * SECOND;

pub(crate) fn settings() -> ViewSettings {
    ViewSettings {
        places: "tcp/192.0.2.10:7447".to_owned(),
        structure: None,
        expected: Vec::new(),
        timeout: Duration::from_secs(1),
        issuer: Ok(OrderIssuer { by: "ada@desk".to_owned(), operator: None }),
        colours: true,
        ascii: false,
    }
}

/// A component of the tower in a state since so many seconds.
pub(crate) fn state(component: &str, state: FaultState, ago_s: u64) -> FaultTransition {
    let component = component.parse().unwrap();
    let time = NOW - ago_s * SECOND;
    FaultTransition {
        verdict: vocabulary::Verdict::example(state),
        sequence: 7,
        ..FaultTransition::untouched("tower".parse().unwrap(), component, time)
    }
}

/// A fault with steps and evidence.
pub(crate) fn latched(component: &str, ago_s: u64) -> FaultTransition {
    let evidence = Evidence {
        step: Step(3110),
        residual: -6.1e-4,
        level: 0.0,
        divergence: Some(4226.0),
        threshold: 10.0,
    };
    FaultTransition {
        run: Some(vocabulary::RunId(3)),
        onset_step: Some(Step(3108)),
        detection_step: Some(Step(3110)),
        decided_step: Some(Step(3118)),
        evidence: Some(evidence),
        ..state(component, FaultState::Latched, ago_s)
    }
}

/// A module of the tower that is heard and in service.
pub(crate) fn heard(module: &str, components: Vec<FaultTransition>) -> ModuleView {
    let view = ModuleView::new(Some("tower".parse().unwrap()), module.parse().unwrap());
    let status = Some(status(module));
    ModuleView { present: true, status, components, heard_unix_ns: NOW, ..view }
}

pub(crate) fn scene(modules: Vec<ModuleView>) -> Scene {
    let network = NetworkState::Open;
    Scene { number: 1, time_unix_ns: NOW, network, modules, ..Scene::default() }
}

fn status(module: &str) -> ModuleStatus {
    let waiting = ModuleStatus::waiting("tower".parse().unwrap(), module.parse().unwrap());
    ModuleStatus {
        phase: vocabulary::ModulePhase::InService,
        in_service_since_step: Some(Step(1)),
        run: Some(vocabulary::RunId(3)),
        step: Some(Step(4711)),
        lag_ms: Some(0.8),
        sample_age_ms: Some(1.1),
        journal: vocabulary::JournalStatus {
            directory: Some("/var/lib".to_owned()),
            bytes: 1,
            ..vocabulary::JournalStatus::default()
        },
        time_unix_ns: NOW,
        ..waiting
    }
}
