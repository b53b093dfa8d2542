//! What is done about faults in the closed loop, on plants that differ from their description by a tenth.

use crate::identification::PLANT;
use crate::tower;
use diagnosis::{GivenOrder, GivenOrderKind};
use study::conditions::Situation;
use study::tolerance::{COUNTED_S, Impediments, Measure, ToleranceCampaign};
use study::{Rig, TimedFault};
use vocabulary::fault::{Fault, FaultKind};
use vocabulary::{ComponentPath, ReadingSource, RunId, Step};

const ONSET: Step = Step(7000);
const GAGE: &str = "module1/sensor/g1";
/// A hundred microstrain of its member.
const BIAS_M: f64 = 300e-6;

/// The plant whose gage has a bias until this step, and these other faults.
fn rig(until: Option<Step>, others: &[TimedFault]) -> Rig {
    let (site, setups) = &*PLANT;
    let fault = Fault::Bias { offset_m: BIAS_M };
    let fault = TimedFault { at: ONSET, until, component: GAGE.parse().unwrap(), fault };
    let faults = [&[fault], others].concat();
    let mut rig = Rig::new(site.plant(5).unwrap(), setups.clone(), faults, RunId(5)).unwrap();
    rig.correct(0);
    rig
}

/// Elongation, interval and source of the gage; its own reading and the true elongation.
fn gage(rig: &Rig) -> ([f64; 3], ReadingSource, [f64; 2]) {
    let readings = rig.corrected(0).unwrap();
    let values = [&readings.elongations_m, &readings.low_m, &readings.high_m];
    let truth = rig.plant().signals().modules[0].true_elongations_m[0];
    let own = rig.samples()[0].elongations_m[0];
    (values.map(|all| all[0].unwrap_or(f64::NAN)), readings.source[0], [own, truth])
}

/// A reading is given and within its interval in this share of the steps.
fn covered(rig: &mut Rig, steps: u64) -> f64 {
    let is_covered = |_| {
        rig.step().unwrap();
        let ([_, low_m, high_m], source, [_, truth_m]) = gage(rig);
        assert_eq!(source, ReadingSource::Replaced, "at step {}", rig.plant().next_step());
        u32::from((low_m..=high_m).contains(&truth_m))
    };
    f64::from((0..steps).map(is_covered).sum::<u32>()) / steps as f64
}

#[test]
fn the_interval_holds_while_a_cylinder_of_the_other_module_is_hard_over() {
    let (at, component) = (ONSET.plus(2100), "module2/actuator/a1".parse().unwrap());
    let hard_over = TimedFault { at, until: None, component, fault: Fault::HardOver {} };
    let mut rig = rig(None, &[hard_over]);
    rig.run(ONSET.0 + 100).unwrap();
    for steps in [2000, 4000] {
        let share = covered(&mut rig, steps);
        assert!(share > 0.85, "{share} in {steps} steps");
    }
}

#[test]
fn a_faulty_gage_is_replaced_until_its_reset_and_the_controller_does_not_notice() {
    let mut rig = rig(Some(Step(12_000)), &[]);
    rig.run(ONSET.0).unwrap();
    let mut quiet = rig.clone().without_faults_of(&GAGE.parse().unwrap());
    let (mut replaced, mut covered, mut squares, mut largest_n) = (0, 0, 0.0, 0.0_f64);
    for _ in 0..5000 {
        rig.step().unwrap();
        quiet.step().unwrap();
        let ([reading_m, low_m, high_m], source, [own_m, truth_m]) = gage(&rig);
        let demands = rig.samples().iter().zip(quiet.samples());
        let apart = demands.flat_map(|(a, b)| a.demands_n.iter().zip(&b.demands_n));
        let apart = apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        match source {
            ReadingSource::Own => {
                assert_eq!((reading_m, replaced), (own_m, 0));
                assert!(rig.plant().next_step() < ONSET.plus(100), "not found");
            }
            ReadingSource::Replaced => {
                replaced += 1;
                covered += u32::from((low_m..=high_m).contains(&truth_m));
                squares += (reading_m - truth_m).powi(2);
            }
            ReadingSource::NotValid => panic!("at step {}", rig.plant().next_step()),
        }
        if replaced > 1000 {
            largest_n = largest_n.max(apart);
        }
    }
    let rms_m = (squares / f64::from(replaced)).sqrt();
    assert!(rms_m < 0.01 * BIAS_M, "{rms_m}");
    assert!(f64::from(covered) > 0.8 * f64::from(replaced), "{covered} of {replaced}");
    assert!(largest_n < 2e3, "demands differ by {largest_n} N from those without the fault");

    // The fault leaves the interval.
    rig.run(6000).unwrap();
    let order = |kind| GivenOrder { kind, by: "ada".into(), on_behalf_of: None, note: None };
    let component = || "sensor/g1".parse().unwrap();
    for kind in [GivenOrderKind::Acknowledge, GivenOrderKind::Reset { force: false }] {
        assert_eq!(rig.order(0, component(), order(kind)), None);
    }
    rig.run(2).unwrap();
    let ([reading_m, ..], source, [own_m, _]) = gage(&rig);
    assert_eq!((source, reading_m), (ReadingSource::Own, own_m));
}

/// Two hard-overs of a plant.
fn hard_overs(seed: u64, situation: Situation) -> ToleranceCampaign {
    ToleranceCampaign {
        system: tower::system(0.1, seed),
        plants: 1,
        cases: 2,
        kinds: vec![FaultKind::HardOver],
        situation: Some(situation),
        counted_s: COUNTED_S,
        impediments: Impediments::default(),
    }
}

#[test]
fn a_cylinder_that_is_hard_over_is_shut_off_or_made_up_for() {
    let campaign = hard_overs(20_261_129, Situation::Alone);
    let rows = tower::rows(&campaign, 0..2, 2);
    assert_eq!(rows.len(), 2);
    for row in rows.values() {
        let of = |measure| &row.relative[&measure];
        for measure in [Measure::Reallocated, Measure::ShutOff, Measure::ShutOffAndReallocated] {
            let top = of(measure).rms_top_m;
            assert!(top < 1.1 && top < of(Measure::Nothing).rms_top_m, "{row:?}");
            assert!(of(measure).largest_demand_n < 110e3, "{row:?}");
        }
        assert!(of(Measure::ShutOff).peak_strain < of(Measure::Nothing).peak_strain, "{row:?}");
        assert!(row.acted_after_s.is_some_and(|time| time < 0.1), "{row:?}");
    }
}

/// Late enough that nothing explains the demands' change any more.
#[test]
fn demands_that_make_up_for_a_cylinder_look_like_no_fault() {
    let campaign = hard_overs(20_261_130, Situation::FromTheStart);
    let rows = tower::rows(&campaign, 0..2, 2);
    assert_eq!(rows.len(), 2);
    for row in rows.values() {
        assert!(row.acted_after_s.is_some() && row.wrong_with.is_empty(), "{row:?}");
    }
}

/// A gage that has stuck departs from its reference before it is declared faulty; the means of these windows are not what it
/// read before the onset.
#[test]
fn no_offset_is_held_from_windows_that_depart() {
    let (site, setups) = &*PLANT;
    for (seed, place) in [(2, 4), (9, 6), (5, 5)] {
        let component = format!("module2/sensor/g{}", place + 1).parse().unwrap();
        let fault = TimedFault { at: ONSET, until: None, component, fault: Fault::Stuck {} };
        let plant = site.plant(seed).unwrap();
        let mut rig = Rig::new(plant, setups.clone(), vec![fault], RunId(5)).unwrap();
        rig.correct(0);
        rig.run(ONSET.0).unwrap();
        let (mut replaced, mut covered) = (0, 0);
        for _ in 0..6000 {
            rig.step().unwrap();
            let readings = rig.corrected(1).unwrap();
            if readings.source[place] == ReadingSource::Replaced {
                let [low_m, high_m] =
                    [&readings.low_m, &readings.high_m].map(|ends| ends[place].unwrap());
                let truth_m = rig.plant().signals().modules[1].true_elongations_m[place];
                replaced += 1;
                covered += u32::from((low_m..=high_m).contains(&truth_m));
            }
        }
        assert!((1000..5000).contains(&replaced), "{seed}: named {replaced} steps before the end");
        let share = f64::from(covered) / f64::from(replaced);
        assert!(share > 0.85, "{seed}: {share} of {replaced} steps");
    }
}

/// Temperatures move gages otherwise than wind does.
#[test]
fn a_reading_holds_for_minutes_in_which_the_weather_changes() {
    let (site, setups) = &*PLANT;
    for (seed, place) in [(3, 6), (4, 5)] {
        let component = format!("module1/sensor/g{}", place + 1).parse().unwrap();
        let fault = TimedFault { at: ONSET, until: None, component, fault: Fault::ZeroOutput {} };
        let plant = site.plant(seed).unwrap();
        let mut rig = Rig::new(plant, setups.clone(), vec![fault], RunId(5)).unwrap();
        rig.correct(0);
        rig.run(ONSET.0 + 240_000).unwrap();
        let (mut squares, mut covered) = (0.0, 0);
        const STEPS: u32 = 60_000;
        for _ in 0..STEPS {
            rig.step().unwrap();
            let readings = rig.corrected(0).unwrap();
            let [reading_m, low_m, high_m] =
                [&readings.elongations_m, &readings.low_m, &readings.high_m]
                    .map(|all| all[place].unwrap());
            let truth_m = rig.plant().signals().modules[0].true_elongations_m[place];
            squares += (reading_m - truth_m).powi(2);
            covered += u32::from((low_m..=high_m).contains(&truth_m));
        }
        let rms_m = (squares / f64::from(STEPS)).sqrt();
        let share = f64::from(covered) / f64::from(STEPS);
        println!("g{}: {rms_m} m, {share}", place + 1);
        assert!(rms_m < 15e-6 && share > 0.8, "{seed}: {rms_m} m, {share}");
    }
}

/// A cylinder leaks so much, and so much more each second; when its leak is said to be as wide as its valve, minute by
/// minute \[s\].
fn leak(begins_m2: f64, per_s_m2: f64, minutes: u64) -> Vec<Option<f64>> {
    let (site, setups) = &*PLANT;
    let component: ComponentPath = "module1/actuator/a2".parse().unwrap();
    let leak = |second: u64| TimedFault {
        at: ONSET.plus(1000 * second),
        until: None,
        component: component.clone(),
        fault: Fault::of_size(KIND, begins_m2 + per_s_m2 * second as f64),
    };
    const KIND: FaultKind = FaultKind::InternalLeakage;
    let faults = (0..60 * minutes).map(leak).collect();
    let mut rig = Rig::new(site.plant(6).unwrap(), setups.clone(), faults, RunId(6)).unwrap();
    rig.run(ONSET.0).unwrap();
    let mut minute = |_| {
        rig.run(60_000).unwrap();
        rig.diagnosers()[0].leak_ends_in_s(&component.component, KIND)
    };
    (0..minutes).map(&mut minute).collect()
}

/// Authority: the widths of valve and leak in the plant. The diagnoser knows those of the description.
#[test]
fn it_is_said_when_a_leak_that_grows_ends_its_cylinder() {
    let hydraulics = &PLANT.0.true_parameters.hydraulics;
    let full_pa = hydraulics.supply_pa - hydraulics.tank_pa;
    let valve_m2 =
        hydraulics.valve_flow_m3_per_s / (2.0 / hydraulics.oil_density_kg_per_m3 * full_pa).sqrt();
    let (begins_m2, ends_s) = (2e-7, 1200.0);
    let course = leak(begins_m2, (valve_m2 - begins_m2) / ends_s, 12);
    for (minute, left_s) in (1..).map(f64::from).zip(&course) {
        match left_s {
            None => assert!(minute < 7.0, "nothing is said after {minute} minutes: {course:?}"),
            Some(left_s) => {
                let total_s = left_s + 60.0 * minute;
                assert!((total_s / ends_s - 1.0).abs() < 0.25, "{total_s}: {course:?}");
            }
        }
    }
}

#[test]
fn a_leak_that_does_not_grow_ends_nothing() {
    let course = leak(5e-7, 0.0, 12);
    assert!(course.iter().all(Option::is_none), "{course:?}");
}
