//! A broken wire costs one channel: the others go on, and what rests on it says so.

use crate::fixture::{Bench, WARM_UP};
use diagnosis::{Action, Doubt, Event, Measurements, Rule, Signal, Symptom, Verdict};
use vocabulary::Step;

const BIAS_M: f64 = 4e-5;
/// Steps without a value after which a signal is lost.
const LOST: u64 = 50;

/// Runs with samples that `spoil` has had its way with.
fn run_spoilt(bench: &mut Bench, steps: u64, spoil: impl Fn(u64, &mut Measurements)) {
    for count in 0..steps {
        let mut sample = bench.signals.sample();
        spoil(count, &mut sample);
        bench.give(Event::Sample(sample));
    }
}

fn no_elongation(_: u64, sample: &mut Measurements) {
    sample.elongations_m[1] = f64::NAN;
}

fn no_pressure(_: u64, sample: &mut Measurements) {
    sample.pressures_pa[0][1] = f64::NAN;
}

fn lost(bench: &Bench) -> Vec<(String, Signal, Step)> {
    let lost = bench.actions.iter().filter_map(|action| match action {
        Action::SignalLost { component, signal, since } => {
            Some((component.to_string(), *signal, *since))
        }
        _ => None,
    });
    lost.collect()
}

#[test]
fn a_gage_without_a_value_is_latched_for_want_of_a_signal() {
    let mut bench = Bench::alone(Rule::FirstChange);
    let since = bench.now().plus(1);
    run_spoilt(&mut bench, LOST - 1, no_elongation);
    assert_eq!(bench.latched(), [""; 0]);
    run_spoilt(&mut bench, 2000, no_elongation);
    assert_eq!(lost(&bench), [("sensor/g2".to_owned(), Signal::Elongation(1), since)]);
    assert_eq!(bench.latched(), ["sensor/g2"]);
    let transition = bench.transitions()[0];
    assert_eq!((transition.symptom, transition.onset), (Symptom::NoSignal, since));
    assert_eq!(transition.detection, since.plus(LOST - 1));
    assert_eq!(bench.diagnoser.counters().samples_non_finite, LOST - 1 + 2000);
    assert_eq!(bench.diagnoser.counters().changes, 0);
}

#[test]
fn the_other_channels_go_on_and_their_faults_are_named() {
    let mut bench = Bench::alone(Rule::FirstChange);
    run_spoilt(&mut bench, 200, no_elongation);
    assert_eq!(bench.diagnoser.phase(), vocabulary::ModulePhase::InService);
    bench.signals.gage_offsets[2] = BIAS_M;
    run_spoilt(&mut bench, 50, no_elongation);
    assert_eq!(bench.latched(), ["sensor/g2", "sensor/g3"]);
}

#[test]
fn what_no_gage_and_no_pressure_can_read_is_no_value() {
    type Spoil = fn(&mut Measurements);
    let spoilers: [(&str, Spoil); 4] = [
        ("sensor/g1", |sample| sample.elongations_m[0] = 1e300),
        ("sensor/g1", |sample| sample.elongations_m[0] = f64::INFINITY),
        ("actuator/a2", |sample| sample.pressures_pa[1][0] = 1e300),
        ("actuator/a2", |sample| sample.demands_n[1] = -1e300),
    ];
    for (component, spoil) in spoilers {
        let mut bench = Bench::alone(Rule::FirstChange);
        run_spoilt(&mut bench, 1000, |_, sample| spoil(sample));
        assert_eq!(bench.latched(), [component]);
        assert_eq!(bench.diagnoser.counters().changes, 0);
    }
}

#[test]
fn a_wire_that_breaks_now_and_then_is_found_too() {
    let mut bench = Bench::alone(Rule::FirstChange);
    run_spoilt(&mut bench, 3000, |count, sample| {
        if count % 20 == 0 {
            no_elongation(count, sample);
        }
    });
    assert_eq!(bench.latched(), ["sensor/g2"]);
    assert_eq!(bench.diagnoser.counters().changes, 0);
}

#[test]
fn a_value_missing_now_and_then_costs_nothing() {
    for missing in 1..=3 {
        let mut bench = Bench::alone(Rule::FirstChange);
        run_spoilt(&mut bench, 5000, |count, sample| {
            if count % 1000 < missing {
                no_elongation(count, sample);
                no_pressure(count, sample);
            }
        });
        assert_eq!(bench.actions, [], "{missing} in a row");
        assert_eq!(bench.diagnoser.phase(), vocabulary::ModulePhase::InService);
    }
}

#[test]
fn without_its_pressure_an_actuator_is_latched_and_gages_are_not_judged() {
    let mut bench = Bench::alone(Rule::FirstChange);
    run_spoilt(&mut bench, 200, no_pressure);
    assert_eq!(bench.latched(), ["actuator/a1"]);
    bench.signals.gage_offsets[2] = BIAS_M;
    run_spoilt(&mut bench, 100, no_pressure);
    let actuator = "lower/actuator/a1".parse().unwrap();
    let doubt = Doubt::Assumed(actuator);
    assert_eq!(bench.verdict("sensor/g3"), Verdict::Unconfirmed { doubt });
    assert_eq!(bench.latched(), ["actuator/a1"]);
}

#[test]
fn a_signal_that_is_back_is_learnt_anew_and_the_fault_stays_until_it_is_reset() {
    for spoil in [no_elongation, no_pressure] {
        let mut bench = Bench::alone(Rule::FirstChange);
        run_spoilt(&mut bench, 500, spoil);
        bench.run(1000 + 2 * WARM_UP);
        assert_eq!(bench.latched().len(), 1);
        assert_eq!(bench.diagnoser.counters().changes, 0);
        assert_eq!(bench.diagnoser.phase(), vocabulary::ModulePhase::InService);
    }
}

#[test]
fn a_signal_that_never_was_is_lost_as_well() {
    let mut bench = Bench::alone(Rule::FirstChange);
    let mut fresh = bench.restarted();
    run_spoilt(&mut fresh, 2 * WARM_UP, no_elongation);
    assert_eq!(fresh.latched(), ["sensor/g2"]);
    assert_eq!(fresh.diagnoser.phase(), vocabulary::ModulePhase::InService);
    bench.run(1);
}
