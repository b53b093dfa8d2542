//! Kind and size of faults of every kind, on a plant that differs from its description by a tenth.

use std::sync::LazyLock;

use crate::tower;
use diagnosis::ModuleSetup;
use diagnosis::identification::IdentificationResult;
use study::commissioning::{PlantSite, usual_snippets};
use study::{Rig, RigEvent, TimedFault};
use truss::Structure;
use vocabulary::SignaturePoint;
use vocabulary::{
    ComponentPath, IdentifiedKind, RunId, Step,
    fault::{Fault, FaultKind},
};

const ONSET: Step = Step(7000);
/// It has long been decided by then.
const END: u64 = 10_100;
const GAGE: &str = "module1/sensor/g1";
const CYLINDER: &str = "module1/actuator/a2";

pub(crate) static PLANT: LazyLock<(PlantSite, Vec<ModuleSetup>)> = LazyLock::new(|| {
    let text = include_str!("../../../configs/tower.toml");
    let structure = Structure::from_toml(text).unwrap();
    let parameters = tower::weather::alike();
    let setups = tower::setups(&structure, &parameters);
    let site = PlantSite::drawn(&structure, &parameters, 0.1, 20_261_501).unwrap();
    let components = setups.iter().flat_map(|setup| {
        let module = setup.module.clone();
        setup
            .components()
            .into_iter()
            .map(move |component| ComponentPath { module: module.clone(), component })
    });
    let actuators: Vec<ComponentPath> =
        components.filter(|path| path.to_string().contains("actuator")).collect();
    let plans = usual_snippets(&actuators, 71_000, 40, 6.0, 100e3);
    let setups = site.commission(&setups, &plans, 2, &|| {}).unwrap();
    (site, setups)
});

/// The latest word on a fault, and every one before it.
fn identified(component: &str, fault: Fault, seed: u64) -> Vec<IdentificationResult> {
    identified_until((component, fault, None), END, seed, None)
}

/// The same of a fault that is repaired at a step, perhaps by diagnosers that do not know a kind.
fn identified_until(
    (component, fault, until): (&str, Fault, Option<Step>),
    end: u64,
    seed: u64,
    without: Option<FaultKind>,
) -> Vec<IdentificationResult> {
    let (site, setups) = &*PLANT;
    let injection = TimedFault { at: ONSET, until, component: component.parse().unwrap(), fault };
    let mut rig =
        Rig::new(site.plant(seed).unwrap(), setups.clone(), vec![injection], RunId(seed)).unwrap();
    rig.identify(without);
    rig.run(end).unwrap();
    let found = rig.take_occurrences().into_iter().filter_map(|occurrence| match occurrence {
        RigEvent::Identified { module, identification } => {
            let path = ComponentPath { module, component: identification.component.clone() };
            (path.to_string() == component).then_some(*identification)
        }
        _ => None,
    });
    found.collect()
}

/// The kind is decided in the end, is never decided otherwise from 200 ms on, and its size, if it is known, is within an
/// eighth.
fn assert_identified(component: &str, fault: Fault, size: Option<f64>, seed: u64) {
    let all = identified(component, fault, seed);
    let latest = all.last().and_then(IdentificationResult::decided);
    assert!(latest.is_some(), "{fault}: {all:?}");
    let latest = latest.unwrap();
    assert_eq!(latest.kind, fault.kind().into(), "{fault}: {latest:?}");
    let settled = all.iter().filter(|found| found.as_of >= ONSET.plus(1000));
    for found in settled.filter_map(IdentificationResult::decided) {
        assert_eq!(found.kind, fault.kind().into(), "{fault}: {found:?}");
    }
    if let Some(size) = size {
        let found = latest.size.unwrap();
        assert!((found.value / size - 1.0).abs() < 0.125, "{fault}: {latest:?}");
        assert!(found.low < found.value && found.value < found.high);
    }
}

/// From the seconds after it, a repaired drift looked like a random walk, and a repaired bias like a bad contact.
#[test]
fn the_kind_of_a_fault_that_was_repaired_stays() {
    for (fault, lasting) in [
        (Fault::Drift { drift_m_per_s: 90e-6 }, 4300),
        (Fault::Drift { drift_m_per_s: -60e-6 }, 6780),
        (Fault::Bias { offset_m: 150e-6 }, 3150),
    ] {
        let repaired = ONSET.plus(lasting);
        let all = identified_until((GAGE, fault, Some(repaired)), repaired.0 + 12_000, 21, None);
        let latest = all.last().and_then(IdentificationResult::decided).unwrap();
        assert_eq!(latest.kind, fault.kind().into(), "{fault}: {latest:?}");
        assert!(all.iter().all(|found| found.as_of <= repaired), "{fault}: {all:?}");
    }
}

/// What followed a hard-over that was repaired within its two seconds looked like a valve that sticks.
#[test]
fn a_cylinders_fault_that_was_repaired_at_once_stays_what_it_was() {
    for (fault, lasting) in [
        (Fault::HardOver {}, 120),
        (Fault::HardOver {}, 600),
        (Fault::HardOver {}, 1450),
        (Fault::ExternalLeakageA { area_m2: 1e-7 }, 700),
    ] {
        let repaired = ONSET.plus(lasting);
        let of = (CYLINDER, fault, Some(repaired));
        let all = identified_until(of, ONSET.0 + 6000, 22, None);
        let latest = all.last().and_then(IdentificationResult::decided);
        let latest = latest.unwrap_or_else(|| panic!("{fault} for {lasting} ms: undecided"));
        assert_eq!(latest.kind, fault.kind().into(), "{fault} for {lasting} ms");
        // The last identification is due two seconds after the onset, and made unless the fault has gone by then.
        let is_repair_seen = all.last().unwrap().as_of > repaired;
        assert!(is_repair_seen || lasting > 1000, "{lasting} ms: nothing was seen of the repair");
    }
}

/// A fault whose kind has no hypothesis is reported as none of these, without a size.
#[test]
fn a_fault_of_an_unknown_kind_is_none_of_the_known_ones() {
    for (component, fault) in [
        (GAGE, Fault::Drift { drift_m_per_s: 1.8e-3 }),
        (GAGE, Fault::RandomWalk { drift_m_per_s: 0.0, increment_m: 2e-6 }),
        (CYLINDER, Fault::ExternalLeakageB { area_m2: 1e-7 }),
        (CYLINDER, Fault::HardOver {}),
    ] {
        let all = identified_until((component, fault, None), END, 23, Some(fault.kind()));
        let latest = all.last().unwrap();
        let first = latest.candidates[0];
        assert_eq!((first.kind, first.size), (IdentifiedKind::NoneOfThese, None), "{fault}");
        assert!(!latest.signature.is_empty(), "{fault}");
    }
}

#[test]
fn a_gages_bias_drift_and_walk_are_told_apart_with_their_size() {
    let (bias, drift) = (45e-6, 1.8e-3);
    assert_identified(GAGE, Fault::Bias { offset_m: bias }, Some(bias), 1);
    assert_identified(GAGE, Fault::Drift { drift_m_per_s: drift }, Some(drift), 2);
    let walk = Fault::RandomWalk { drift_m_per_s: 0.0, increment_m: 2e-6 };
    assert_identified("module1/sensor/g3", walk, None, 3);
}

#[test]
fn a_gage_that_reads_zero_or_stands_still_is_told_from_one_that_is_off() {
    assert_identified("module1/sensor/g2", Fault::ZeroOutput {}, None, 4);
    let stuck = identified(GAGE, Fault::Stuck {}, 5);
    let latest = stuck.last().and_then(IdentificationResult::decided).map(|found| found.kind);
    assert!(stuck.is_empty() || latest == Some(FaultKind::Stuck.into()), "{stuck:?}");
}

#[test]
fn a_gain_is_no_bias_once_the_load_moves_and_a_bad_contact_neither() {
    assert_identified("module1/sensor/g2", Fault::Gain { gain: 1.6 }, Some(1.6), 11);
    let contact = Fault::Intermittent { offset_m: 60e-6, closed_s: 0.2, open_s: 0.1 };
    assert_identified(GAGE, contact, Some(60e-6), 12);
}

#[test]
fn of_a_gage_without_a_signal_that_is_all_that_is_said() {
    let all = identified(GAGE, Fault::NoSignal {}, 13);
    let [only] = &all[..] else { panic!("{all:?}") };
    assert_eq!(only.decided().map(|found| found.kind), Some(FaultKind::NoSignal.into()));
    assert!(only.signature.is_empty());
}

/// Fitted and measured agree to within a twentieth of the bias, before the onset and after it.
#[test]
fn the_signature_of_a_bias_is_a_step_from_its_onset_on() {
    let offset_m = 45e-6;
    let all = identified(GAGE, Fault::Bias { offset_m }, 1);
    let points = &all.last().unwrap().signature;
    assert!((20..=120).contains(&points.len()), "{}", points.len());
    let (before, after): (Vec<&SignaturePoint>, Vec<_>) =
        points.iter().partition(|point| point.step < ONSET);
    assert!(before.len() > 5 && after.len() > 5);
    let level = before.iter().map(|point| point.fitted).sum::<f64>() / before.len() as f64;
    for point in points {
        let expected = level + if point.step < ONSET { 0.0 } else { offset_m };
        assert!((point.fitted - expected).abs() < 0.05 * offset_m, "{point:?}");
        assert!((point.measured - expected).abs() < 0.05 * offset_m, "{point:?}");
    }
}

#[test]
fn a_cylinders_leaks_are_told_apart_with_their_size() {
    let area_m2 = 1e-7;
    assert_identified(CYLINDER, Fault::InternalLeakage { area_m2 }, Some(area_m2), 6);
    assert_identified(CYLINDER, Fault::ExternalLeakageA { area_m2 }, Some(area_m2), 7);
    assert_identified(CYLINDER, Fault::ExternalLeakageB { area_m2 }, Some(area_m2), 8);
}

#[test]
fn a_hard_over_and_a_sticking_valve_are_no_leaks() {
    assert_identified(CYLINDER, Fault::HardOver {}, None, 9);
    assert_identified(CYLINDER, Fault::Stiction { band_m3_per_s: 2e-5 }, None, 10);
}
