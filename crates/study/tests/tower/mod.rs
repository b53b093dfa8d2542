//! The shipped tower with settings of its own, independent of the shipped configurations.

#![allow(dead_code, reason = "every test takes the parts that it needs")]
#![allow(clippy::unwrap_used, reason = "test code")]

pub mod taller;
pub mod weather;

use diagnosis::divergence::{DivergenceSettings, Interval};
use diagnosis::residual::{ActuatorResidual, NominalHydraulics};
use diagnosis::{DetectionSettings, IsolationSettings, ModuleSetup, Rule, SignalSettings, Verdict};
use std::sync::atomic::AtomicBool;
use vocabulary::fault::Fault;

use plant::PlantParameters;
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use study::{Begin, Campaign, Done, Engine, Rig, RigEvent, Rows, System, TimedFault};
use truss::Structure;
use vocabulary::{ComponentPath, RunId, Step};

pub fn bias(offset_m: f64) -> Fault {
    Fault::Bias { offset_m }
}

pub fn random_walk() -> Fault {
    Fault::RandomWalk { drift_m_per_s: 60e-6, increment_m: 6e-6 }
}

pub fn leakage() -> Fault {
    Fault::InternalLeakage { area_m2: 3e-7 }
}

pub fn hard_over() -> Fault {
    Fault::HardOver {}
}

pub fn parts() -> (Structure, PlantParameters, Vec<ModuleSetup>) {
    let structure = Structure::from_toml(include_str!("../../../../configs/tower.toml")).unwrap();
    let parameters = PlantParameters::default();
    let setups = setups(&structure, &parameters);
    (structure, parameters, setups)
}

/// A diagnoser for each equipped module, each other one its peer.
pub fn setups(structure: &Structure, parameters: &PlantParameters) -> Vec<ModuleSetup> {
    let names: Vec<_> = structure.equipped().map(|module| module.name.clone()).collect();
    let h = &parameters.hydraulics;
    let setups = names.iter().map(|name| ModuleSetup {
        module: name.clone(),
        structure: structure.local(name).unwrap(),
        hydraulics: Some(NominalHydraulics {
            area_a_m2: h.area_a_m2,
            area_b_m2: h.area_b_m2,
            volume_a_m3: h.volume_a_m3,
            volume_b_m3: h.volume_b_m3,
            bulk_modulus_pa: h.bulk_modulus_pa,
            force_gain_m3_per_s_n: h.force_gain_m3_per_s_per_n,
            valve_flow_m3_per_s: h.valve_flow_m3_per_s,
            supply_pa: h.supply_pa,
            tank_pa: h.tank_pa,
            pressure_noise_pa: h.pressure_noise_pa,
            speed_uncertainty: 0.25,
        }),
        gage_noise_strain: parameters.gages.noise_strain,
        step_s: parameters.step_s,
        signals: SignalSettings::default(),
        detection: DetectionSettings {
            divergence: DivergenceSettings {
                window: 12,
                lag: 5,
                interval: Interval::Sliding { vectors: 2000 },
            },
            actuator_residual: ActuatorResidual::Tracking,
            warm_up_vectors: 2500,
        },
        isolation: IsolationSettings {
            rule: Rule::FirstChange,
            hold_steps: 6,
            tie_steps: 3,
            root_ratio: 30.0,
            effect_steps: 250,
            quiet_steps: 40,
        },
        // about twice what healthy runs reach
        thresholds: vec![0.0035; 12],
        peers: names.iter().filter(|peer| *peer != name).cloned().collect(),
        reference: None,
        learned: None,
        readings: Vec::new(),
    });
    setups.collect()
}

pub fn rig(seed: u64, injections: Vec<TimedFault>) -> Rig {
    let (structure, parameters, setups) = parts();
    let plant = study::plant(&structure, &parameters, 0.0, seed).unwrap();
    Rig::new(plant, setups, injections, RunId(seed)).unwrap()
}

/// The tower with its own plants.
pub fn system(mismatch: f64, seed: u64) -> System {
    let (structure, parameters, setups) = parts();
    let (name, controllers) = (String::new(), Vec::new());
    System { name, structure, parameters, setups, mismatch, controllers, seed }
}

/// A campaign of short runs: 3 s without and 2 s with a fault.
pub fn campaign(rule: Rule) -> ScenarioCampaign {
    let mut system = system(0.1, 7);
    system.setups.iter_mut().for_each(|setup| setup.isolation.rule = rule);
    let ranges = ScenarioRanges { length_s: 5.0, onset_s: [3.0, 3.2], ..ScenarioRanges::default() };
    scenarios(system, ranges)
}

/// A thousand runs with a fault, and then a thousand without.
pub fn scenarios(system: System, ranges: ScenarioRanges) -> ScenarioCampaign {
    ScenarioCampaign { system, ranges, scenarios: 1000, nominal: 1000 }
}

static NEVER: AtomicBool = AtomicBool::new(false);
const BEGIN: Begin = &|_, _| Box::new(|| ());

/// Runs cases without a report of progress.
pub fn engine(jobs: usize) -> Engine<'static> {
    Engine { jobs, stop: &NEVER, begin: BEGIN }
}

/// What comes of these cases.
pub fn rows<C: Campaign>(campaign: &C, cases: std::ops::Range<u64>, jobs: usize) -> Rows<C::Row> {
    let mut done = Done::default();
    engine(jobs).run(campaign, cases, &mut done, None).unwrap();
    done.rows
}

/// What comes of a case.
pub fn row<C: Campaign>(campaign: &C, case: u64) -> C::Row {
    engine(2).watch(campaign, case, &mut |_, _| Ok(())).unwrap()
}

/// The component and the step of a fault that was committed.
pub fn latched(occurrence: &RigEvent) -> Option<(ComponentPath, Step)> {
    let (component, transition) = occurrence.transition()?;
    (transition.verdict == Verdict::Latched).then_some((component, transition.detection))
}
