//! Messages far longer than any of ours, from a stranger to a diagnoser: they are not kept, their sender's link goes
//! on, and so does the diagnosis. `security` does the same to a router.

use std::time::Duration;

use daemon::config::Schedule;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::footprint::most_resident_kib;
use system_tests::hostile::{LARGE_ROOM_KIB, blocking_session, put_large};
use system_tests::observer::Observer;
use system_tests::turn;
use vocabulary::{Injection, RunId, fault::Fault};
use zenoh::Session;

const GAGE: &str = "module1/sensor/g2";
const SAMPLES: &str = "trusswatch/tower/module1/sample";
/// Longer than the test.
const STEPS: u64 = 100_000_000;
/// For a command.
const WITHIN: Duration = Duration::from_secs(20);

async fn inject(session: &Session) {
    let fault = Some(Fault::Bias { offset_m: 4e-4 });
    let order = Injection { component: GAGE.parse().unwrap(), fault, at_step: None };
    let structure = "tower".parse().unwrap();
    session::client::inject(session, &structure, &order, WITHIN).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "measures memory: wants the machine for itself"]
async fn a_stranger_cannot_fill_the_memory_of_a_diagnoser_with_one_message() {
    let _turn = turn::alone().await;
    let deployment = Deployment::of_tower(&Schedule::default());
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let plant = deployment.start_plant("real", STEPS, 11, RunId(11));
    let before = observer.status_of("module1", |status| status.in_service_since_step.is_some());
    let before = before.await.intake.malformed;
    let most_kib = || most_resident_kib(diagnosers[0].pid()).unwrap();
    let memory = most_kib();
    let stranger = blocking_session(&deployment.endpoints[1..2]).await;
    put_large(&stranger, SAMPLES).await;
    // The link goes on: what comes after the large messages arrives, and is all that did.
    stranger.put(SAMPLES, "short").await.unwrap();
    let after = observer.status_of("module1", |status| status.intake.malformed > before).await;
    println!("most memory {memory} KiB before, {} KiB after", most_kib());
    assert!(most_kib() <= memory + LARGE_ROOM_KIB, "from {memory} to {} KiB", most_kib());
    assert_eq!(after.intake.malformed, before + 1, "the large ones are not received");
    inject(&observer.session).await;
    let status = observer.status_of("module1", |status| status.latched > 0).await;
    assert_eq!((status.diagnosis.samples_missing, status.intake.dropped), (0, 0), "{status:?}");
    session::close(&stranger).await;
    plant.stop().await;
    for process in diagnosers {
        process.stop().await;
    }
}
