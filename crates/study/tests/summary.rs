//! What records come to, held against counts made by hand.

use names::Step;
use names::fault::{Fault, FaultKind};
use study::summary::{Found, Interval95};
use study::{Closest, Confusion, Conversation, Diagnosed, NominalRecord, ScenarioRecord, Summary};

fn diagnosed(component: &str, detection: u64) -> Diagnosed {
    let component = component.parse().unwrap();
    Diagnosed { component, detection: Step(detection), decided: Step(detection + 6) }
}

/// A run of 1000 steps with a fault of m/sensor/g1 from step 600 on.
fn record(number: u64, fault: Fault, diagnosed: Vec<Diagnosed>) -> ScenarioRecord {
    ScenarioRecord {
        number,
        seed: 7 * number,
        component: "m/sensor/g1".parse().unwrap(),
        fault,
        onset: Step(600),
        steps: 1000,
        base_speed_m_per_s: 10.0,
        reading_over_noise: Some(20.0),
        diagnosed,
        conversation: Conversation { questions: 1, ..Conversation::default() },
    }
}

fn bias() -> Fault {
    Fault::Bias { offset_m: 1e-4 }
}

#[test]
fn exact_means_the_right_component_and_nothing_else_and_nothing_before() {
    let right = diagnosed("m/sensor/g1", 602);
    assert!(record(0, bias(), vec![right.clone()]).is_exact());
    let wrong = diagnosed("m/sensor/g2", 640);
    let with_wrong = record(0, bias(), vec![right.clone(), wrong]);
    assert!(with_wrong.is_detected() && !with_wrong.is_exact());
    // the right component, but before its fault: an alarm, not a detection
    let early = record(0, bias(), vec![diagnosed("m/sensor/g1", 599)]);
    assert!(early.is_false_alarm() && !early.is_detected() && !early.is_exact());
    assert!(early.named().is_none());
    assert!(!record(0, bias(), vec![]).is_exact());
}

#[test]
fn samples_count_as_flagged_from_the_verdict_on() {
    let confusion = |detections: &[u64]| {
        let diagnosed = detections.iter().map(|&at| diagnosed("m/sensor/g2", at)).collect();
        let Confusion { true_positive, false_negative, false_positive, true_negative } =
            record(0, bias(), diagnosed).confusion();
        [true_positive, false_negative, false_positive, true_negative]
    };
    assert_eq!(confusion(&[]), [0, 400, 0, 600]);
    assert_eq!(confusion(&[604, 610]), [390, 10, 0, 600]);
    assert_eq!(confusion(&[494]), [400, 0, 100, 500]);
    assert_eq!(confusion(&[2000]), [0, 400, 0, 600]);
}

#[test]
fn a_summary_counts_what_happened_whatever_the_order_of_the_records() {
    let mut quiet = record(3, Fault::ZeroOutput {}, vec![]);
    quiet.reading_over_noise = Some(2.0);
    let records = [
        record(0, bias(), vec![diagnosed("m/sensor/g1", 600)]),
        record(1, bias(), vec![diagnosed("m/sensor/g1", 604), diagnosed("m/sensor/g2", 604)]),
        record(2, Fault::ZeroOutput {}, vec![diagnosed("m/sensor/g1", 610)]),
        quiet,
    ];
    let nominal = |number, diagnosed| NominalRecord {
        number,
        seed: number,
        base_speed_m_per_s: 8.0,
        diagnosed,
        closest: Some(Closest {
            component: "m/sensor/g2".parse().unwrap(),
            step: Step(number),
            ratio: 0.5,
        }),
        conversation: Conversation::default(),
    };
    let nominals = [nominal(0, vec![]), nominal(1, vec![diagnosed("m/sensor/g1", 5)])];
    let summary = Summary::of(&records, &nominals, 1e-3);
    assert_eq!((summary.scenarios, summary.nominal_runs, summary.false_alarm_runs), (4, 2, 1));
    // equally near: the first run counts
    assert_eq!(summary.closest.as_ref().map(|closest| closest.step), Some(Step(0)));
    assert_eq!(summary.exact_isolation.overall, 0.5);
    assert_eq!(summary.exact_isolation.by_kind[&FaultKind::Bias], 0.5);
    assert_eq!((summary.wrong_component_runs, summary.missed_runs, summary.early_runs), (1, 1, 0));
    assert_eq!(summary.not_exact, [1, 3]);
    assert_eq!(summary.readable_zero_outputs, Found { all: 1, found: 1 });
    let delays = summary.delay_ms[&FaultKind::Bias];
    assert_eq!((delays.median, delays.max), (Some(0.0), Some(4.0)));
    assert_eq!(summary.verdict_delay_ms[&FaultKind::Bias].max, Some(10.0));
    let table = summary.paper_table;
    let sum =
        table.true_positive + table.false_negative + table.false_positive + table.true_negative;
    assert!((sum - 1.0).abs() < 1e-12);
    assert!((table.false_negative - (6.0 + 10.0 + 16.0 + 400.0) / 4000.0).abs() < 1e-12);
    let Interval95(low, high) = summary.paper_table_95.false_negative;
    assert!(low < table.false_negative && table.false_negative < high);
    let reversed: Vec<_> = records.iter().rev().cloned().collect();
    assert_eq!(Summary::of(&reversed, &nominals, 1e-3), summary);
}

#[test]
fn no_runs_make_a_summary_too() {
    let summary = Summary::of(&[], &[], 1e-3);
    assert_eq!((summary.scenarios, summary.accuracy), (0, 0.0));
    assert_eq!(summary.false_alarm_runs_95, Interval95(0.0, 1.0));
}
