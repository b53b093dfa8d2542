//! What records come to, held against counts made by hand.

use study::scenarios::{Closest, Conversation, FoundCount, ScenarioRow, ScenarioSummary};
use study::{Diagnosed, Interval95, Rows, TimedFault};
use vocabulary::{
    Step,
    fault::{Fault, FaultKind},
};

fn diagnosed(component: &str, detection: u64) -> Diagnosed {
    let component = component.parse().unwrap();
    Diagnosed { component, detection: Step(detection), decided: Step(detection + 6) }
}

/// A run of 1000 steps with a fault of m/sensor/g1 from step 600 on.
fn record(fault: Fault, diagnosed: Vec<Diagnosed>) -> ScenarioRow {
    let component = "m/sensor/g1".parse().unwrap();
    ScenarioRow {
        seed: 7,
        injection: Some(TimedFault { at: Step(600), until: None, component, fault }),
        steps: 1000,
        base_speed_m_per_s: 10.0,
        reading_over_noise: Some(20.0),
        closest: None,
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
    assert!(record(bias(), vec![right.clone()]).is_exact());
    let wrong = diagnosed("m/sensor/g2", 640);
    let with_wrong = record(bias(), vec![right.clone(), wrong]);
    assert!(with_wrong.is_detected() && !with_wrong.is_exact());
    // the right component, but before its fault: an alarm, not a detection
    let early = record(bias(), vec![diagnosed("m/sensor/g1", 599)]);
    assert!(early.is_false_alarm() && !early.is_detected() && !early.is_exact());
    assert!(early.named().is_none());
    assert!(!record(bias(), vec![]).is_exact());
}

#[test]
fn samples_count_as_flagged_from_the_verdict_on() {
    let samples = |detections: &[u64]| {
        let diagnosed = detections.iter().map(|&at| diagnosed("m/sensor/g2", at)).collect();
        let of = record(bias(), diagnosed).samples();
        [of.true_positive, of.false_negative, of.false_positive, of.true_negative]
    };
    assert_eq!(samples(&[]), [0, 400, 0, 600]);
    assert_eq!(samples(&[604, 610]), [390, 10, 0, 600]);
    assert_eq!(samples(&[494]), [400, 0, 100, 500]);
    assert_eq!(samples(&[2000]), [0, 400, 0, 600]);
}

#[test]
fn a_summary_counts_what_happened() {
    let mut quiet = record(Fault::ZeroOutput {}, vec![]);
    quiet.reading_over_noise = Some(2.0);
    let records = [
        record(bias(), vec![diagnosed("m/sensor/g1", 600)]),
        record(bias(), vec![diagnosed("m/sensor/g1", 604), diagnosed("m/sensor/g2", 604)]),
        record(Fault::ZeroOutput {}, vec![diagnosed("m/sensor/g1", 610)]),
        quiet,
    ];
    let nominal = |step, diagnosed| ScenarioRow {
        injection: None,
        reading_over_noise: None,
        closest: Some(Closest {
            component: "m/sensor/g2".parse().unwrap(),
            step: Step(step),
            ratio: 0.5,
        }),
        ..record(bias(), diagnosed)
    };
    let nominals = [nominal(0, vec![]), nominal(1, vec![diagnosed("m/sensor/g1", 494)])];
    let rows: Rows<ScenarioRow> = (0..).zip(records.into_iter().chain(nominals)).collect();
    let summary = ScenarioSummary::of(&rows, 1e-3, 400);
    let counts = (summary.all.cases, summary.nominal.cases, summary.nominal.false_alarms);
    assert_eq!(counts, (4, 2, 1));
    // watched from step 400: 600 steps, and 100 up to the alarm
    let hours = 0.7 / 3600.0;
    let of_nominal = &summary.nominal;
    assert!((of_nominal.hours / hours - 1.0).abs() < 1e-12);
    assert!((of_nominal.per_hour * hours - 1.0).abs() < 1e-12);
    let Interval95(low, high) = of_nominal.per_hour_95;
    assert!((low * hours - 0.0253).abs() < 1e-4 && (high * hours - 5.5716).abs() < 1e-4);
    // equally near: the first run counts
    assert_eq!(summary.nominal.closest.as_ref().map(|closest| closest.step), Some(Step(0)));
    assert_eq!((summary.all.exact, summary.all.exact_share()), (2, 0.5));
    let of_bias = &summary.kinds[&FaultKind::Bias];
    assert_eq!((of_bias.cases, of_bias.exact, of_bias.wrong), (2, 1, 1));
    assert_eq!((summary.all.wrong, summary.all.missed, summary.all.early), (1, 1, 0));
    assert_eq!(summary.not_exact, [1, 3]);
    assert_eq!(summary.readable_zero_outputs, FoundCount { all: 1, found: 1 });
    let delays = of_bias.delay_ms;
    assert_eq!((delays.median, delays.max), (Some(0.0), Some(4.0)));
    assert_eq!(of_bias.verdict_delay_ms.max, Some(10.0));
    let table = summary.samples;
    let sum =
        table.true_positive + table.false_negative + table.false_positive + table.true_negative;
    assert!((sum - 1.0).abs() < 1e-12);
    assert!((table.false_negative - (6.0 + 10.0 + 16.0 + 400.0) / 4000.0).abs() < 1e-12);
    // of 4000 samples 1600 are warm-up, and 432 wrong
    assert!((summary.watched_accuracy - (2400.0 - 432.0) / 2400.0).abs() < 1e-12);
    let Interval95(low, high) = summary.samples_95.false_negative;
    assert!(low < table.false_negative && table.false_negative < high);
}

#[test]
fn no_runs_make_a_summary_too() {
    let summary = ScenarioSummary::of(&Rows::new(), 1e-3, 400);
    assert_eq!((summary.all.cases, summary.samples.accuracy), (0, 0.0));
    assert_eq!(summary.nominal.false_alarms_95, Interval95(0.0, 1.0));
    assert_eq!((summary.nominal.hours, summary.watched_accuracy), (0.0, 0.0));
    assert_eq!(summary.nominal.per_hour_95, Interval95(0.0, f64::INFINITY));
}
