//! What a faulty gage should read goes over the network while anyone listens, with the help of the peers' forces.
//!
//! Authority: the fault that the plant was given, and the plant's samples.

use std::collections::BTreeMap;

use crate::support::{LIMIT, Rig, first, in_time};
use daemon::config::{PlantFlags, ScheduledFault, Speed};
use plant::ToleranceSettings;
use tokio::sync::mpsc;
use vocabulary::{
    ComponentPath, Corrected, FaultTransition, Message, ModuleName, PlantStatus, ReadingSource,
    RunId, Sample, Step, fault::Fault, keys::Watched,
};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

const ONSET: Step = Step(6000);
/// A bias of some twenty microstrain.
const OFFSET_M: f64 = 1.5e-4;
/// Steps of the run; all is said some time before its end.
const STEPS: u64 = 9000;
/// A replaced reading is this near to the true one.
const NEAR_M: f64 = 4e-5;
/// By which the interval narrows from one step to the next with the peer's forces; the healthy gages' errors, which are
/// averaged over windows, change it by a tenth at most.
const AT_ONCE: f64 = 0.85;

async fn subscribe<M: Message + Send + 'static>(
    observer: &Session,
    key: String,
) -> (Subscriber<()>, mpsc::UnboundedReceiver<M>) {
    let (outlet, inbox) = mpsc::unbounded_channel();
    let subscriber = observer.declare_subscriber(key).callback(move |sample| {
        let message = vocabulary::decode(&sample.payload().to_bytes()).unwrap();
        let _ = outlet.send(message);
    });
    (subscriber.await.unwrap(), inbox)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_faulty_gage_is_replaced_over_the_network() {
    let flags = PlantFlags {
        speed: Some(Speed::Factor(2.0)),
        steps: Some(STEPS),
        run_id: Some(RunId(42)),
        ..PlantFlags::default()
    };
    let mut rig = Rig::new("plant.toml", &["module1.toml", "module2.toml"], &flags).patient();
    rig.plant.schedule.faults = vec![ScheduledFault {
        at_step: ONSET,
        until_step: None,
        component: "module2/sensor/g5".parse().unwrap(),
        fault: Fault::Bias { offset_m: OFFSET_M },
    }];
    let diagnosers = [rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let observer = rig.observer().await;
    let (structure, all) = (rig.plant.structure.name.clone(), rig.modules());
    session::client::wait_for(&observer, &structure, &all, false, LIMIT).await.unwrap();
    let module: ModuleName = "module2".parse().unwrap();
    let watched = Watched { structure: Some(&structure), module: Some(&module) };
    let (_listening, mut corrected) = subscribe::<Corrected>(&observer, watched.corrected()).await;
    let (_sampling, mut samples) = subscribe::<Sample>(&observer, watched.samples()).await;
    let plant = rig.start_plant();

    let mut own = BTreeMap::new();
    let (mut before, mut replaced, mut half_m, mut least) = (0, 0, f64::NAN, 1.0);
    in_time("the end of the run", async {
        loop {
            let Corrected { step, readings, forces_n, .. } = corrected.recv().await.unwrap();
            while !own.contains_key(&step) {
                let sample = samples.recv().await.unwrap();
                own.insert(sample.step, sample.elongations_m[4]);
            }
            assert_eq!((readings.source.len(), forces_n.len()), (8, 4));
            let Some(reading_m) = readings.elongations_m[4] else {
                assert!(step < ONSET, "not valid at step {step}");
                continue;
            };
            let own_m = own[&step];
            if readings.source[4] == ReadingSource::Own {
                assert_eq!(reading_m, own_m);
                before += 1;
                continue;
            }
            assert!(step > ONSET);
            assert!((own_m - OFFSET_M - reading_m).abs() < NEAR_M, "{own_m} {reading_m}");
            replaced += 1;
            let former_m = half_m;
            half_m = 0.5 * (readings.high_m[4].unwrap() - readings.low_m[4].unwrap());
            least = f64::min(least, half_m / former_m);
            if step >= Step(STEPS - 200) {
                break;
            }
        }
    })
    .await;
    assert!(before > 1000 && replaced > 1000, "{before} own readings, {replaced} replaced");
    assert!(least < AT_ONCE, "the peer's forces are not used: {least}");
    let replies = observer.get("trusswatch/tower/module2/fault/sensor/g5").await.unwrap();
    let reply = in_time("the state", replies.recv_async()).await.unwrap().into_result().unwrap();
    let state: FaultTransition = vocabulary::decode(&reply.payload().to_bytes()).unwrap();
    let reading = state.reading.unwrap();
    let off_m = reading.own_m.unwrap() - reading.elongation_m.unwrap();
    assert!((off_m - OFFSET_M).abs() < NEAR_M, "{reading:?}");
    plant.end().await;
    for diagnoser in diagnosers {
        diagnoser.stop().await;
    }
}

/// Waits until the plant's controller does without these components.
async fn does_without(observer: &Session, components: &[&ComponentPath]) {
    let what = format!("a controller without {components:?}");
    let read = |received: &zenoh::sample::Sample| {
        let status = vocabulary::decode::<PlantStatus>(&received.payload().to_bytes()).ok()?;
        status.done_without.iter().eq(components.iter().copied()).then_some(())
    };
    first(observer, "trusswatch/*/plant/status", &what, read).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_controller_uses_corrected_readings_and_makes_up_for_cylinders_while_it_is_told() {
    let flags = PlantFlags { speed: Some(Speed::Factor(2.0)), ..PlantFlags::default() };
    let mut rig = Rig::new("plant.toml", &["module1.toml", "module2.toml"], &flags);
    let (gage, cylinder): (ComponentPath, ComponentPath) =
        ("module2/sensor/g3".parse().unwrap(), "module1/actuator/a1".parse().unwrap());
    let fault = |at: u64, component: &ComponentPath, fault: Fault| ScheduledFault {
        at_step: Step(at),
        until_step: None,
        component: component.clone(),
        fault,
    };
    rig.plant.schedule.faults = vec![
        fault(ONSET.0, &gage, Fault::Bias { offset_m: OFFSET_M }),
        fault(ONSET.0 + 4000, &cylinder, Fault::HardOver {}),
    ];
    rig.plant.tolerance = ToleranceSettings {
        corrected_readings: true,
        largest_innovation: Some(3e-6),
        reallocation: true,
        // On a busy machine readings take their time; that a module is silent is noticed a second later.
        stale_after_ms: 2000,
        ..ToleranceSettings::default()
    };
    let diagnosers = [rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let observer = rig.observer().await;
    let (structure, all) = (rig.plant.structure.name.clone(), rig.modules());
    session::client::wait_for(&observer, &structure, &all, false, LIMIT).await.unwrap();
    let plant = rig.start_plant();
    does_without(&observer, &[&gage]).await;
    does_without(&observer, &[&cylinder, &gage]).await;
    // A silent module leaves its gages to themselves, but repairs no cylinder.
    for diagnoser in diagnosers {
        diagnoser.stop().await;
    }
    does_without(&observer, &[&cylinder]).await;
    plant.stop().await;
}
