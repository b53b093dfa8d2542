//! Made-up states for tests, beside those of `observer::testing`.

use observer::{ModuleView, testing};
use vocabulary::{Evidence, FaultState, FaultTransition, ModulePhase, Step, Unknown};

/// A module that has come to step 4711 in this phase.
pub(crate) fn module(
    name: &str,
    phase: ModulePhase,
    components: Vec<FaultTransition>,
) -> ModuleView {
    let mut module = testing::module(name, phase, components);
    let status = module.status.as_mut().unwrap();
    (status.step, status.lag_ms, status.sample_age_ms) = (Some(Step(4711)), Some(1.2), Some(3.0));
    module
}

/// Of a module whose samples have stopped.
pub(super) fn unknown_state(component: &str) -> FaultTransition {
    let reason = "no sample for 500 ms".to_owned();
    testing::state(component, FaultState::Normal)
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
        ..testing::state(component, FaultState::Latched)
    }
}
