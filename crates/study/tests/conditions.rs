//! Faults that no change shows, on one commissioned tower.

use std::sync::{Arc, LazyLock};

use crate::tower;
use diagnosis::state::{Condition, ReferenceProblem};
use diagnosis::{Diagnoser, ModuleSetup, SetupError};
use names::RunId;
use study::conditions::{
    CaseKind, CommissionedPlant, ConditionCampaign, Situation, Standing, run_case, tally,
};
use study::{Rig, Schedule, parallel};

/// The tower, two cases of each situation.
fn campaign() -> ConditionCampaign {
    let (structure, parameters, setups) = tower::parts();
    ConditionCampaign {
        structure,
        parameters,
        setups,
        mismatch: 0.1,
        seed: 20_261_201,
        cases_per_plant: 2 * Situation::ALL.len() as u64,
        kind: CaseKind::default(),
    }
}

/// The first plant of that, which most of these tests look at.
static PLANT: LazyLock<CommissionedPlant> = LazyLock::new(|| commissioned(&campaign()));

fn commissioned(campaign: &ConditionCampaign) -> CommissionedPlant {
    campaign.commission(0, 2, &|| {}).unwrap()
}

#[test]
fn hidden_faults_are_found_and_nothing_healthy_is_named() {
    let (campaign, plant) = (campaign(), &*PLANT);
    let numbers: Vec<u64> = (0..campaign.cases_per_plant).collect();
    let mut records = Vec::new();
    let work = |number: &u64| {
        run_case(&plant.site, &plant.setups, &campaign.case(plant, *number)?, |_, _| {})
    };
    let done = |_: &u64, record| {
        records.push(record);
        Ok::<_, study::StudyError>(())
    };
    parallel::for_each(&numbers, 2, &false.into(), work, done).unwrap();
    for record in &records {
        assert_eq!(record.healthy_named, [], "case {}", record.number);
        for (component, fault, standing, named) in &record.faulty {
            let is_found =
                matches!(standing, Standing::Named | Standing::Likeliest | Standing::InAGroup);
            assert!(is_found, "case {}: {component}, {fault}: {standing:?}", record.number);
            assert_eq!(named.is_some(), *standing == Standing::Named);
        }
    }
    let tallies = tally(&records, campaign.parameters.step_s);
    assert!(Situation::ALL.iter().all(|situation| tallies[situation].cases == 2));
    assert_eq!(tallies[&Situation::Healthy].all_faults(), 0);
    assert_eq!(tallies[&Situation::Second].all_faults(), 4);
}

#[test]
fn a_plant_and_its_cases_follow_from_seed_and_number() {
    let (campaign, plant) = (campaign(), &*PLANT);
    let case = |number| campaign.case(plant, number).unwrap();
    assert_eq!(case(5), case(5));
    assert_ne!(case(5).seed, case(6).seed);
    assert_eq!([0, 13, 14].map(|case| campaign.plant_of(case)), [0, 0, 1]);
    let again = commissioned(&campaign);
    let reference = |plant: &CommissionedPlant| plant.setups[0].reference.clone();
    assert_eq!(reference(plant), reference(&again));
    assert_eq!(plant.seed, again.seed);
}

#[test]
fn modules_without_peers_have_references_of_their_own() {
    let mut campaign = campaign();
    campaign.setups.iter_mut().for_each(|setup| setup.peers.clear());
    for setup in commissioned(&campaign).setups {
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
    let (structure, parameters, setups) = tower::parts();
    let plant = study::plant(&structure, &parameters, 0.1, 3).unwrap();
    let mut rig = Rig::new(plant, setups, Schedule::default(), RunId(3)).unwrap();
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
    other_settings.hydraulics.volume_a_m3 *= 1.01;
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
