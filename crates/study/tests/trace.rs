//! A trace records what the rig does, and changes nothing in it.

use crate::tower;
use study::trace::RunTrace;
use study::{RigEvent, TimedFault};
use vocabulary::{ComponentKind, Step};

fn injections() -> Vec<TimedFault> {
    let component = "module1/sensor/g2".parse().unwrap();
    vec![TimedFault { at: Step(3000), until: None, component, fault: tower::bias(180e-6) }]
}

#[test]
fn a_traced_run_is_the_run_without_the_trace() {
    let mut plain = tower::rig(5, injections());
    plain.run(3200).unwrap();
    let mut traced = tower::rig(5, injections());
    let trace = RunTrace::record(&mut traced, 3200).unwrap();
    assert_eq!(trace.occurrences, plain.take_occurrences());
    assert!(trace.occurrences.iter().any(|o| matches!(o, RigEvent::Transition { .. })));
    assert_eq!(trace.steps, (0..3200).map(Step).collect::<Vec<_>>());
    let latest = plain.samples().iter().zip(plain.diagnosers());
    for (module, (sample, diagnoser)) in trace.modules.iter().zip(latest) {
        let last = |signals: &[Vec<f64>]| signals.iter().map(|x| x[3199]).collect::<Vec<_>>();
        assert_eq!(last(&module.demands_n), sample.demands_n);
        assert_eq!(last(&module.elongations_m), sample.elongations_m);
        assert_eq!(module.of_kind(ComponentKind::Actuator).count(), 4);
        assert_eq!(module.of_kind(ComponentKind::Sensor).count(), 8);
        for (channel, evidence) in module.channels.iter().zip(diagnoser.evidence()) {
            assert_eq!(channel.residual[3199], evidence.residual);
            assert_eq!(channel.divergence[3199], evidence.divergence.unwrap());
            assert_eq!(channel.threshold, evidence.threshold);
            assert!(channel.divergence[0].is_nan(), "undefined at first");
        }
    }
}

#[test]
fn one_trace_goes_on_where_the_other_ended() {
    let mut rig = tower::rig(5, Vec::new());
    let whole = RunTrace::record(&mut tower::rig(5, Vec::new()), 300).unwrap();
    RunTrace::record(&mut rig, 200).unwrap();
    let rest = RunTrace::record(&mut rig, 100).unwrap();
    assert_eq!(rest.steps, whole.steps[200..]);
    assert_eq!(rest.modules[1].demands_n[2], whole.modules[1].demands_n[2][200..]);
}
