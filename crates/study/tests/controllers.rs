//! Whatever the controller demands, healthy cylinders that follow it as well as they can are not named.

use crate::tower;
use study::ControllerTuning;
use study::scenarios::ScenarioRanges;

/// Large biases and a random walk of gages, which an aggressive controller turns into jumps of the demand of tens of
/// kilonewtons. In each of them a healthy cylinder of a plant 20 % off was named besides, as long as the rule for jumps
/// did not take into account what was demanded.
#[test]
fn what_an_aggressive_controller_demands_names_no_healthy_cylinder() {
    let mut system = tower::system(0.2, 777);
    system.controllers = vec![ControllerTuning::Aggressive];
    let campaign = tower::scenarios(system, ScenarioRanges::default());
    for number in [26, 39, 53] {
        let record = tower::row(&campaign, number);
        assert!(record.is_exact(), "{number}: {:?}", record.diagnosed);
    }
}
