//! A tower with four equipped modules, each commissioned in weather with all others as its peers: what the comparison with
//! a reference finds in it.

use std::sync::LazyLock;

use crate::tower;
use diagnosis::ModuleSetup;
use study::commissioning::{PlantSite, usual_snippets};
use study::conditions::{ConditionCampaign, ConditionRow, HiddenFaults, Situation, Standing};
use study::{
    Campaign, CampaignCase, CaseRun, Rig, RigEvent, SampleGap, System, TimedFault, parallel,
};
use truss::Structure;
use vocabulary::{Component, ComponentPath, ModuleName, RunId, Step, fault::Fault};

const JOBS: usize = 2;
const SECOND: u64 = 1000;
/// Both answers are in service by then.
const SETTLED: u64 = 7 * SECOND;
/// After the last fault.
const AFTER: u64 = 12 * SECOND;
/// Shorter snippets than usual, for they take most of the time here.
const SNIPPET_S: f64 = 6.0;
const STROKE_N: f64 = 100e3;
const BIAS_STRAIN: f64 = 10e-6;
/// Columns and diagonals.
const GAGES: [&str; 4] = ["g1", "g4", "g5", "g7"];

static PLANT: LazyLock<Commissioned> = LazyLock::new(|| Commissioned::new(4));

/// A plant whose diagnosers have references.
struct Commissioned {
    structure: Structure,
    site: PlantSite,
    setups: Vec<ModuleSetup>,
}

impl Commissioned {
    fn new(modules: usize) -> Self {
        let structure = tower::taller::with_equipped(modules);
        let parameters = tower::weather::alike();
        let setups = tower::setups(&structure, &parameters);
        assert!(setups.iter().all(|setup| setup.peers.len() == modules - 1));
        let site = PlantSite::drawn(&structure, &parameters, 0.1, 20_261_210).unwrap();
        let actuators: Vec<ComponentPath> = setups.iter().flat_map(actuators).collect();
        let values =
            structure.equipped().map(|module| module.components().count() as u64).sum::<u64>();
        let plans = usual_snippets(&actuators, 61_000, values + 12, SNIPPET_S, STROKE_N);
        let setups = site.commission(&setups, &plans, JOBS, &|| {}).unwrap();
        Self { structure, site, setups }
    }

    fn modules(&self) -> impl Iterator<Item = &ModuleName> {
        self.setups.iter().map(|setup| &setup.module)
    }

    /// A component of the module at this place; those behind the last begin anew.
    fn component(&self, place: usize, component: &str) -> ComponentPath {
        let module = &self.setups[place % self.setups.len()].module;
        format!("{module}/{component}").parse().unwrap()
    }

    fn bias(&self, place: usize, gage: &str, strain: f64, at: u64) -> TimedFault {
        let component = self.component(place, &format!("sensor/{gage}"));
        let module = self.structure.module(&component.module).unwrap();
        let gage = module.gages.iter().find(|known| known.name.as_str() == gage).unwrap();
        let offset_m = strain * self.structure.gage_length_m(gage);
        TimedFault { at: Step(at), until: None, component, fault: Fault::Bias { offset_m } }
    }

    fn leak(&self, place: usize, actuator: &str, at: u64) -> TimedFault {
        let component = self.component(place, &format!("actuator/{actuator}"));
        let fault = Fault::InternalLeakage { area_m2: 5e-8 };
        TimedFault { at: Step(at), until: None, component, fault }
    }

    /// A bias from the start of several gages of each module. The module so many places further on is absent: it gets
    /// no sample and answers nothing.
    fn hidden_from_the_start(&self, absent: Option<usize>) -> Vec<CampaignCase<Situation>> {
        let modules = self.setups.len();
        let gages = (0..modules).flat_map(|place| GAGES.map(|gage| (place, gage)));
        let case = |(number, (place, gage)): (usize, (usize, &str))| {
            let strain = if number.is_multiple_of(2) { BIAS_STRAIN } else { -BIAS_STRAIN };
            let mut case =
                case(number, Situation::FromTheStart, vec![self.bias(place, gage, strain, 0)]);
            case.gaps.extend(absent.map(|further| SampleGap {
                place: (place + further) % modules,
                from: Step(0),
                until: Step(u64::MAX),
                restarted: false,
            }));
            case
        };
        gages.enumerate().map(case).collect()
    }

    /// A second fault soon after a first one in another module.
    fn second(&self) -> Vec<CampaignCase<Situation>> {
        let pairs = |place: usize| {
            let first = || self.bias(place, "g2", 2.0 * BIAS_STRAIN, SETTLED);
            let later = SETTLED + 700 * (1 + place as u64);
            [
                vec![first(), self.bias(place + 1, "g8", -2.0 * BIAS_STRAIN, later)],
                vec![first(), self.leak(place + 1, "a3", later)],
                vec![
                    self.bias(place, "g3", BIAS_STRAIN, 0),
                    self.bias(place + 2, "g6", BIAS_STRAIN, 0),
                ],
            ]
        };
        let pairs = (0..self.setups.len()).flat_map(pairs).enumerate();
        pairs.map(|(number, faults)| case(100 + number, Situation::Second, faults)).collect()
    }

    fn run(&self, cases: &[CampaignCase<Situation>]) -> Vec<(u64, ConditionRow)> {
        let mut records = Vec::new();
        let campaign = campaign(self.structure.clone());
        let work = |case: &CampaignCase<Situation>| {
            let (plant, run) = (self.site.plant(case.seed)?, RunId(case.seed));
            let rig = Rig::new(plant, self.setups.clone(), case.faults.clone(), run)?;
            campaign.judge(case, &mut CaseRun::new(case, rig, &mut |_, _| Ok(())))
        };
        let done = |case: &CampaignCase<Situation>, row| {
            records.push((case.number, row));
            Ok::<_, study::StudyError>(())
        };
        parallel::for_each(cases, JOBS, &false.into(), work, done).unwrap();
        records
    }
}

fn actuators(setup: &ModuleSetup) -> impl Iterator<Item = ComponentPath> {
    let module = setup.module.clone();
    let components = setup.components().into_iter();
    components
        .filter(|component| matches!(component, Component::Actuator(_)))
        .map(move |component| ComponentPath { module: module.clone(), component })
}

fn case(number: usize, kind: Situation, faults: Vec<TimedFault>) -> CampaignCase<Situation> {
    let steps = faults.last().map_or(0, |last| last.at.0) + AFTER;
    let (number, gaps) = (number as u64, Vec::new());
    CampaignCase { number, kind, seed: 41_000 + number, faults, gaps, kept_samples: 0, steps }
}

fn campaign(structure: Structure) -> ConditionCampaign {
    let parameters = tower::weather::alike();
    let setups = tower::setups(&structure, &parameters);
    let (name, controllers) = (String::new(), Vec::new());
    let system =
        System { name, structure, parameters, setups, mismatch: 0.1, controllers, seed: 1 };
    let (situations, hidden) = (Vec::new(), HiddenFaults::default());
    ConditionCampaign { system, situations, hidden, plants: 1, cases: 1, alone: false }
}

/// Each fault is named, or among those of which one is faulty; what is healthy is not named.
fn check(rows: &[(u64, ConditionRow)], may_be_in_group: bool) {
    for (case, row) in rows {
        assert_eq!(row.healthy_named, [], "case {case}");
        for faulty in &row.faulty {
            let found = match faulty.standing {
                Standing::Named => true,
                Standing::Likeliest | Standing::InAGroup => may_be_in_group,
                Standing::CannotTell | Standing::Normal => false,
            };
            assert!(found, "case {case}: {faulty:?}");
        }
    }
}

#[test]
fn a_campaign_commissions_with_more_snippets_than_a_reference_has_values() {
    let snippets = |modules: usize| {
        campaign(tower::taller::with_equipped(modules)).system.snippets_per_plant()
    };
    // 12 values and twice four strokes a module
    assert_eq!([2, 3, 4].map(snippets), [40 + 16, 48 + 24, 60 + 32]);
}

#[test]
fn a_reference_knows_every_peer() {
    for setup in &PLANT.setups {
        let reference = setup.reference.as_ref().unwrap();
        let others = PLANT.modules().filter(|module| **module != setup.module);
        assert!(reference.peers().eq(others));
        assert_eq!(reference.gages.len(), 8 * PLANT.setups.len());
    }
}

#[test]
fn healthy_minutes_have_no_transition() {
    let run = |seed: &u64| {
        let healthy = PLANT.site.plant(*seed)?;
        let mut rig = Rig::new(healthy, PLANT.setups.clone(), Vec::new(), RunId(*seed))?;
        rig.run(60 * SECOND)?;
        let occurrences = rig.take_occurrences().into_iter();
        let transition = |o: &RigEvent| matches!(o, RigEvent::Transition { .. });
        Ok::<Vec<_>, study::StudyError>(occurrences.filter(transition).collect())
    };
    let done = |seed: &u64, transitions: Vec<RigEvent>| {
        assert!(transitions.is_empty(), "seed {seed}: {transitions:?}");
        Ok(())
    };
    parallel::for_each(&[51, 52], JOBS, &false.into(), run, done).unwrap();
}

#[test]
fn biases_from_the_start_are_named() {
    check(&PLANT.run(&PLANT.hidden_from_the_start(None)), false);
}

#[test]
fn without_one_of_the_peers_the_true_gage_is_among_the_suspects() {
    check(&PLANT.run(&PLANT.hidden_from_the_start(Some(1))), true);
}

#[test]
fn second_faults_in_other_modules_are_named() {
    check(&PLANT.run(&PLANT.second()), false);
}
