//! For every fault that a diagnoser latches there is a freeze frame, over the network and in the operator's program, also
//! after a restart.
//!
//! Authority: the faults that the plant was given, those of the demo, and the transitions in the journal.

use std::collections::BTreeSet;
use std::time::Duration;

use daemon::config::{Schedule, ScheduledFault};
use system_tests::deployment::{Deployment, MODULES};
use system_tests::observer::Observer;
use system_tests::operate::trusswatch;
use system_tests::{LIMIT, in_time, turn};
use vocabulary::{FaultState, FaultTransition, FreezeFrame, ModuleName, RunId, Step, fault::Fault};

/// The first fault, and from one to the next.
const FIRST: u64 = 3600;
const BETWEEN: u64 = 3600;
/// So long a fault lasts.
const LASTS: u64 = 1200;
/// Steps in two seconds.
const AROUND: u64 = 2000;

/// The faults of the demo, one after the other, each repaired before the next; the last one, which no change shows, goes on.
fn schedule() -> Schedule {
    let faults = [
        ("module1/sensor/g2", Fault::Bias { offset_m: 1.5e-4 }),
        ("module1/actuator/a3", Fault::InternalLeakage { area_m2: 3e-7 }),
        ("module2/actuator/a4", Fault::ExternalLeakageA { area_m2: 3e-7 }),
        ("module1/actuator/a1", Fault::HardOver {}),
        ("module2/sensor/g1", Fault::Bias { offset_m: -6e-4 }),
        ("module1/sensor/g7", Fault::RandomWalk { drift_m_per_s: 2e-4, increment_m: 2e-5 }),
        ("module2/sensor/g3", Fault::Drift { drift_m_per_s: 9e-5 }),
    ];
    let last = faults.len() - 1;
    let fault = |(place, (component, fault)): (usize, (&str, Fault))| {
        let at = FIRST + BETWEEN * place as u64;
        ScheduledFault {
            at_step: Step(at),
            until_step: (place < last).then_some(Step(at + LASTS)),
            component: component.parse().unwrap(),
            fault,
        }
    };
    Schedule { faults: faults.into_iter().enumerate().map(fault).collect() }
}

/// The transitions that latched something, from the journals.
async fn latched(observer: &Observer) -> Vec<FaultTransition> {
    let mut latched = Vec::new();
    for module in MODULES {
        let module: ModuleName = module.parse().unwrap();
        let (session, structure) = (&observer.session, &observer.structure);
        let history = session::client::history(session, structure, &module, 1, LIMIT).await;
        assert_eq!(history.broken_off, None);
        latched
            .extend(history.transitions.into_iter().filter(|t| t.state() == FaultState::Latched));
    }
    latched
}

/// The frame of a transition, as soon as it is there: the latest ones end when samples do.
async fn frame(observer: &Observer, latched: &FaultTransition) -> FreezeFrame {
    let (session, structure) = (&observer.session, &observer.structure);
    in_time("a freeze frame", async {
        loop {
            let (module, sequence) = (&latched.module, latched.sequence);
            let frame = session::client::freeze_frame(session, structure, module, sequence, LIMIT);
            if let Ok(frame) = frame.await {
                return frame;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    })
    .await
}

/// It shows what the transition says.
fn check(frame: &FreezeFrame, latched: &FaultTransition) {
    assert_eq!((&frame.component, frame.incarnation), (&latched.component, latched.incarnation));
    assert_eq!(Some(frame.signals.run), latched.run);
    let (onset, detection) = (latched.onset_step.unwrap(), latched.detection_step.unwrap());
    assert_eq!((frame.signals.onset_step, frame.signals.detection_step), (onset, detection));
    let first = onset.min(detection).minus(AROUND);
    let steps: Vec<Step> = (first.0..).map(Step).take(frame.signals.steps.len()).collect();
    assert_eq!(frame.signals.steps, steps, "nothing was lost");
    let decided = latched.decided_step.unwrap();
    let last = *frame.signals.steps.last().unwrap();
    assert!(last <= decided.plus(AROUND) && last > decided, "{last} {decided}");
    let place = frame.signals.steps.iter().position(|step| *step == detection).unwrap();
    let values =
        |name| &frame.signals.traces.iter().find(|trace| trace.name == name).unwrap().values;
    let evidence = latched.evidence.as_ref().unwrap();
    if latched.symptom == vocabulary::Symptom::Change {
        assert!(values("divergence")[place] >= Some(frame.signals.threshold));
        assert_eq!(values("divergence")[place], evidence.divergence);
        assert_eq!(values("residual")[place], Some(evidence.residual));
    }
    assert!(values("residual").iter().filter(|value| value.is_some()).count() > 3000);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_fault_of_the_demo_has_one() {
    let _turn = turn::side_by_side().await;
    let schedule = schedule();
    let deployment = Deployment::of_tower(&schedule);
    deployment.patient();
    let mut diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let steps = FIRST + BETWEEN * schedule.faults.len() as u64;
    let mut plant = deployment.start_plant("max", steps, 5, RunId(61));
    assert_eq!(plant.exit_code().await, Some(0), "{}", plant.log());

    let injected: BTreeSet<_> = schedule.faults.iter().map(|fault| &fault.component).collect();
    let all = latched(&observer).await;
    let named: BTreeSet<_> = all.iter().map(|transition| &transition.component).collect();
    assert_eq!(named, injected, "{}", deployment.logs());
    let mut frames = Vec::new();
    for latched in &all {
        let frame = frame(&observer, latched).await;
        check(&frame, latched);
        frames.push(frame);
    }

    // The last one ended with the samples, not after two seconds, and all of them are there after a restart.
    let restarted = diagnosers.pop().unwrap();
    restarted.stop().await;
    observer.wait_until_gone("module2").await;
    let again = deployment.start_diagnoser(1);
    observer.wait_for(&["module2"], false).await;
    let late = all.iter().zip(&frames).rfind(|(latched, _)| latched.module.as_str() == "module2");
    let (latched, known) = late.unwrap();
    assert_eq!(frame(&observer, latched).await, *known);

    let (structure, module) = (&observer.structure, &latched.module);
    let refused =
        session::client::freeze_frame(&observer.session, structure, module, 9999, LIMIT).await;
    let refused = refused.unwrap_err().to_string();
    let number = latched.sequence.to_string();
    assert!(refused.contains("transition 9999") && refused.contains(&number), "{refused}");

    for component in ["module1/actuator/a1", "module2/sensor/g1"] {
        let file = deployment.state_directory(0).join("drawn.svg");
        let words = ["fault", "show", component, "--svg", file.to_str().unwrap()];
        let shown = trusswatch(&deployment, &words).await;
        assert_eq!(shown.code, Some(0), "{shown:?}");
        assert!(shown.out.contains("┊ detection step"), "{}", shown.out);
        let drawn = std::fs::read_to_string(file).unwrap();
        assert!(drawn.contains(component) && drawn.contains("D / γ"), "{drawn}");
    }
    for process in diagnosers.into_iter().chain([again]) {
        process.stop().await;
    }
    observer.session.close().await.unwrap();
}
