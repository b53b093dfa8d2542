//! What is kept around the latching of a fault.

use crate::fixture::{Bench, WARM_UP};
use diagnosis::{Action, Event, Rule};
use vocabulary::{Component, FrozenSignals, RunId, Step, Trace};

/// Steps in two seconds.
const AROUND: u64 = 2000;
const BIAS_M: f64 = 4e-5;

fn frames(bench: &Bench) -> Vec<(Component, FrozenSignals)> {
    let frames = bench.actions.iter().filter_map(|action| match action {
        Action::Freeze { component, signals } => Some((component.clone(), (**signals).clone())),
        _ => None,
    });
    frames.collect()
}

fn trace<'a>(frame: &'a FrozenSignals, name: &str) -> &'a Trace {
    frame.traces.iter().find(|trace| trace.name == name).unwrap()
}

/// A bench without peers that has been in service for more than two seconds.
fn in_service() -> Bench {
    let mut bench = Bench::alone(Rule::FirstChange);
    bench.run(AROUND + 500);
    bench.actions.clear();
    bench
}

#[test]
fn a_frame_has_every_step_from_two_seconds_before_the_onset_to_two_after_the_latching() {
    let mut bench = in_service();
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(100);
    let latched = bench.transitions().into_iter().find(|t| t.verdict.is_latched()).unwrap().clone();
    assert_eq!(frames(&bench), [], "not complete yet");
    bench.run(latched.decided.plus(AROUND).since(bench.now()) - 1);
    assert_eq!(frames(&bench), [], "a step is missing");
    bench.run(1);
    let [(component, frame)] = &frames(&bench)[..] else { panic!("one frame") };
    assert_eq!((frame.run, frame.sequence), (latched.run, latched.sequence));
    assert_eq!(component.to_string(), "sensor/g1");
    let steps = [frame.onset_step, frame.detection_step, frame.decided_step];
    assert_eq!(steps, [latched.onset, latched.detection, latched.decided]);
    let from = latched.onset.minus(AROUND);
    let expected: Vec<Step> = (from.0..=latched.decided.0 + AROUND).map(Step).collect();
    assert_eq!(frame.steps, expected);
    let names: Vec<&str> = frame.traces.iter().map(|trace| trace.name.as_str()).collect();
    assert_eq!(names, ["reading", "residual", "divergence"]);
    assert!(frame.traces.iter().all(|trace| trace.values.len() == frame.steps.len()));
    let at = |step: Step| frame.steps.iter().position(|known| *known == step).unwrap();
    let detection = at(latched.detection);
    assert_eq!(trace(frame, "residual").values[detection], Some(latched.evidence.residual));
    assert_eq!(trace(frame, "divergence").values[detection], latched.evidence.divergence);
    assert_eq!(frame.threshold, latched.evidence.threshold);
    assert!(trace(frame, "divergence").values[detection - 1] < Some(frame.threshold));
    let reading = |step: Step| trace(frame, "reading").values[at(step)].unwrap();
    assert!(reading(latched.onset.minus(1)).abs() < BIAS_M / 2.0);
    assert!(reading(latched.onset) > BIAS_M / 2.0);
    bench.run(2 * AROUND);
    assert_eq!(frames(&bench).len(), 1, "once");
}

#[test]
fn steps_without_a_sample_are_left_out() {
    let mut bench = in_service();
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(500);
    let lost = bench.signals.step;
    bench.signals.step = lost.plus(2);
    bench.run(AROUND);
    let [(_, frame)] = &frames(&bench)[..] else { panic!("one frame") };
    let around: Vec<u64> =
        frame.steps.iter().map(|step| step.0).filter(|step| step.abs_diff(lost.0) <= 3).collect();
    let expected: Vec<u64> =
        (lost.0 - 3..=lost.0 + 3).filter(|step| *step != lost.0 && *step != lost.0 + 1).collect();
    assert_eq!(around, expected);
}

#[test]
fn two_faults_at_once_have_a_frame_each_and_a_cylinder_shows_its_pressures() {
    let mut bench = in_service();
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(300);
    bench.signals.pressure_offsets[0] = f64::NAN;
    bench.run(AROUND + 300);
    let frames = frames(&bench);
    let latched: Vec<(String, u64)> = bench
        .transitions()
        .into_iter()
        .filter(|t| t.verdict.is_latched())
        .map(|t| (t.component.to_string(), t.sequence))
        .collect();
    let framed: Vec<(String, u64)> =
        frames.iter().map(|(component, frame)| (component.to_string(), frame.sequence)).collect();
    assert_eq!(framed, latched);
    let cylinder = frames.iter().find(|(component, _)| component.to_string() == "actuator/a1");
    let (_, cylinder) = cylinder.unwrap();
    let names: Vec<&str> = cylinder.traces.iter().map(|trace| trace.name.as_str()).collect();
    assert_eq!(names, ["demand", "force", "residual", "divergence", "pressure_a", "pressure_b"]);
    let [begin, end] = [
        trace(cylinder, "pressure_a").values[0],
        *trace(cylinder, "pressure_a").values.last().unwrap(),
    ];
    assert!(begin.is_some() && end.is_none(), "a missing value is none");
}

#[test]
fn a_frame_ends_with_its_run_or_when_no_sample_follows() {
    for next_run in [true, false] {
        let mut bench = in_service();
        bench.signals.gage_offsets[0] = BIAS_M;
        bench.run(500);
        let last = bench.now();
        assert_eq!(frames(&bench), []);
        if next_run {
            bench.signals.run = RunId(2);
            bench.signals.step = Step(0);
            bench.run(1);
        } else {
            bench.diagnoser.end_freeze_frames(&mut bench.actions);
        }
        let [(_, frame)] = &frames(&bench)[..] else { panic!("one frame") };
        assert_eq!((frame.run, frame.steps.last()), (RunId(1), Some(&last)));
        bench.run(2 * AROUND);
        assert_eq!(frames(&bench).len(), 1, "once");
    }
}

#[test]
fn what_was_latched_before_a_restart_has_no_frame() {
    let mut bench = in_service();
    bench.signals.gage_offsets[0] = BIAS_M;
    bench.run(100);
    assert_eq!(bench.latched(), ["sensor/g1"]);
    let mut restarted = bench.restarted();
    restarted.signals.gage_offsets[0] = BIAS_M;
    restarted.run(WARM_UP + 2 * AROUND);
    assert_eq!(restarted.latched(), ["sensor/g1"]);
    assert_eq!(frames(&restarted), []);
}

/// The frames are the only difference that it makes when they are asked for.
#[test]
fn frames_alter_no_verdict() {
    let transitions = |ending: bool| {
        let mut bench = in_service();
        for step in 0..1000 {
            bench.signals.gage_offsets[0] = if step >= 300 { BIAS_M } else { 0.0 };
            let sample = bench.signals.sample();
            bench.give(Event::Sample(sample));
            if ending {
                bench.diagnoser.end_freeze_frames(&mut bench.actions);
            }
        }
        bench.actions.retain(|action| !matches!(action, Action::Freeze { .. }));
        bench.actions
    };
    assert_eq!(transitions(false), transitions(true));
}
