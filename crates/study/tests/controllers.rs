//! Whatever the controller demands, healthy cylinders that follow it as well as they can are not named.

use crate::tower;
use study::{Campaign, Controller, ScenarioRanges};

/// Large biases and a random walk of gages, which an aggressive controller turns into jumps of the demand of tens of
/// kilonewtons. In each of them a healthy cylinder of a plant 20 % off was named besides, as long as the rule for jumps
/// did not take into account what was demanded.
#[test]
fn what_an_aggressive_controller_demands_names_no_healthy_cylinder() {
    let (structure, parameters, setups) = tower::parts();
    let campaign = Campaign {
        structure,
        parameters,
        setups,
        mismatch: 0.2,
        controllers: vec![Controller::Aggressive],
        seed: 777,
        ranges: ScenarioRanges::default(),
    };
    for number in [26, 39, 53] {
        let record = campaign.run_scenario(number).unwrap();
        assert!(record.is_exact(), "{number}: {:?}", record.diagnosed);
    }
}
