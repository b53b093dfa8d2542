//! Faults that no change shows, on one commissioned tower.

use std::sync::{Arc, LazyLock};

use crate::tower;
use diagnosis::state::{Condition, ReferenceProblem};
use diagnosis::{Diagnoser, ModuleSetup, SetupError};
use study::conditions::{ConditionCampaign, HiddenFaults, Situation, Standing};
use study::{Campaign, CommissionedPlant, System};

/// The tower, two cases of each situation.
fn campaign() -> ConditionCampaign {
    ConditionCampaign {
        system: tower::system(0.1, 20_261_201),
        situations: Situation::HIDDEN.to_vec(),
        hidden: HiddenFaults::default(),
        plants: 1,
        cases: 2 * Situation::HIDDEN.len() as u64,
        alone: false,
    }
}

/// The first plant of that, which most of these tests look at.
pub static PLANT: LazyLock<CommissionedPlant> = LazyLock::new(|| commissioned(&campaign().system));

fn commissioned(system: &System) -> CommissionedPlant {
    system.commission(0, 2, &|| {}).unwrap()
}

#[test]
fn hidden_faults_are_found_and_nothing_healthy_is_named() {
    let campaign = campaign();
    let rows = tower::rows(&campaign, 0..campaign.cases(), 2);
    for (case, row) in &rows {
        assert_eq!(row.healthy_named, [], "case {case}");
        for faulty in &row.faulty {
            let is_found = matches!(
                faulty.standing,
                Standing::Named | Standing::Likeliest | Standing::InAGroup
            );
            assert!(is_found, "case {case}: {faulty:?}");
            assert_eq!(faulty.named.is_some(), faulty.standing == Standing::Named);
        }
    }
    let summary = campaign.summarize(&rows);
    assert!(summary.situations.values().all(|tally| tally.cases == 2));
    assert_eq!(summary.situations.len(), Situation::HIDDEN.len());
    assert_eq!(summary.situations[&Situation::Healthy].faults, 0);
    assert_eq!(summary.situations[&Situation::Second].faults, 4);
}

#[test]
fn a_plant_and_its_cases_follow_from_seed_and_number() {
    let (campaign, plant) = (campaign(), &*PLANT);
    let case = |number| campaign.draw(number, Some(plant)).unwrap();
    assert_eq!(case(5), case(5));
    assert_ne!(case(5).seed, case(6).seed);
    let plants = [0, 13, 14].map(|case| campaign.plant_of(case));
    assert_eq!(plants, [(0, Some(0)), (0, Some(0)), (0, Some(1))]);
    let again = commissioned(&campaign.system);
    let reference = |plant: &CommissionedPlant| plant.setups[0].reference.clone();
    assert_eq!(reference(plant), reference(&again));
    assert_eq!(plant.seed, again.seed);
}

#[test]
fn modules_without_peers_have_references_of_their_own() {
    let mut system = campaign().system;
    system.setups.iter_mut().for_each(|setup| setup.peers.clear());
    for setup in commissioned(&system).setups {
        let reference = setup.reference.clone().unwrap();
        assert_eq!((reference.gages.len(), reference.forces.len()), (8, 4));
        assert_eq!(reference.peers().count(), 0);
        let [alone, together] = reference.long.largest_left_out;
        assert_eq!(alone, together);
        assert_eq!(setup.problems(), []);
    }
}

#[test]
fn without_a_reference_nothing_is_verified() {
    let mut rig = tower::system(0.1, 1).rig(3, Vec::new()).unwrap();
    rig.run(5000).unwrap();
    for diagnoser in rig.diagnosers() {
        assert!(diagnoser.conditions().all(|condition| *condition == Condition::NotVerified));
    }
}

#[test]
fn a_reference_of_something_else_is_refused() {
    let setups = &PLANT.setups;
    let problems = |setup: ModuleSetup| -> Vec<ReferenceProblem> {
        let problem = |error| match error {
            SetupError::Reference(problem) => problem,
            other => panic!("{other}"),
        };
        Diagnoser::new(setup).unwrap_err().into_iter().map(problem).collect()
    };
    let is = |problems: &[ReferenceProblem], wanted: fn(&ReferenceProblem) -> bool| {
        assert!(matches!(problems, [only] if wanted(only)), "{problems:?}");
    };
    let mut other_settings = setups[0].clone();
    other_settings.hydraulics.as_mut().unwrap().volume_a_m3 *= 1.01;
    is(&problems(other_settings), |p| matches!(p, ReferenceProblem::OtherSettings { .. }));
    let mut other_module = setups[0].clone();
    other_module.reference.clone_from(&setups[1].reference);
    is(&problems(other_module), |p| matches!(p, ReferenceProblem::OtherModule { .. }));
    let mut without_peers = setups[0].clone();
    without_peers.peers.clear();
    is(&problems(without_peers), |p| matches!(p, ReferenceProblem::Components));
    let mut version = setups[0].clone();
    let reference = version.reference.take().unwrap();
    version.reference =
        Some(Arc::new(diagnosis::state::Reference { version: 9, ..(*reference).clone() }));
    is(&problems(version), |p| matches!(p, ReferenceProblem::Version(9)));
}
