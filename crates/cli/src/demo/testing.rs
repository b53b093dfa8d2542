//! Made-up acts and transitions for tests.

use names::Step;
use names::fault::Fault;
use wire::{FaultState, FaultTransition};

use super::story::{Act, Pace, Story};

pub(super) const PACE: Pace = Pace { step_s: 1e-3, warm_up: 50, effects: 25, interval: 20 };

pub(super) fn acts() -> Vec<Act> {
    let act = |path: &str, fault, injected| Act {
        story: Story { title: "t", component: path.parse().unwrap(), fault, lasts_s: 0.015 },
        injected: Step(injected),
        repaired: Step(injected + 15),
        over: Step(injected + 900),
    };
    vec![
        act("m1/sensor/g1", Fault::ZeroOutput {}, 100),
        act("m2/actuator/a1", Fault::HardOver {}, 1000),
    ]
}

pub(super) fn transition(component: &str, state: FaultState, detected: u64) -> FaultTransition {
    FaultTransition {
        verdict: wire::Verdict::example(state),
        sequence: 1,
        detection_step: Some(Step(detected)),
        decided_step: Some(Step(detected)),
        ..FaultTransition::untouched("t".parse().unwrap(), component.parse().unwrap(), 0)
    }
}
