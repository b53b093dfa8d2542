//! Two processes that run as the same module notice each other, and an observer notices both.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use crate::support::{LIMIT, Rig, in_time, status};
use daemon::config::PlantFlags;
use observer::ModuleView;
use session::client::present;
use vocabulary::ModuleStatus;
use zenoh::Session;

/// Diagnosers publish often.
fn rig() -> Rig {
    let same = ["small/lower.toml"; 2];
    let mut rig = Rig::new("small/plant.toml", &same, &PlantFlags::default());
    for diagnoser in &mut rig.diagnosers {
        diagnoser.publish.status_every_ms = 100;
    }
    rig
}

/// The module as an observer sees it.
async fn seen(observer: &Session) -> ModuleView {
    let expected = ["lower".parse().unwrap()];
    let scene = present(observer, None, &expected, LIMIT).await.unwrap();
    scene.module(None, &expected[0]).unwrap().clone()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn another_process_of_the_same_module_is_reported_until_it_is_gone() {
    let rig = rig();
    let (first, second) = (rig.start_diagnoser(0), rig.start_diagnoser(1));
    let observer = rig.observer().await;
    in_time("both processes", async { while seen(&observer).await.processes.len() != 2 {} }).await;
    assert!(seen(&observer).await.has_several_processes());
    status(&observer, |status| status.another_process).await;
    second.stop().await;
    status(&observer, |status| !status.another_process).await;
    let seen = seen(&observer).await;
    assert_eq!((seen.processes.len(), seen.has_several_processes()), (1, false));
    first.stop().await;
    session::close(&observer).await;
}

/// A process that goes on for this long beside another one is not about to end (`diagnoser::namesakes`).
const NOT_ENDING: Duration = Duration::from_secs(3);

/// Waits until two processes are seen and each has published three more statuses: each has heard of the other then.
async fn both_have_heard_of_each_other(observer: &Session) {
    in_time("both processes", async { while seen(observer).await.processes.len() != 2 {} }).await;
    let statuses = observer.declare_subscriber("trusswatch/*/lower/status").await.unwrap();
    let mut of_each: BTreeMap<_, usize> = BTreeMap::new();
    in_time("three statuses of each process", async {
        while of_each.values().filter(|count| **count >= 3).count() < 2 {
            let received = statuses.recv_async().await.unwrap();
            let status: ModuleStatus = vocabulary::decode(&received.payload().to_bytes()).unwrap();
            *of_each.entry(status.journal.directory).or_default() += 1;
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_predecessor_that_ends_is_not_another_process() {
    // The state directory says whose status it is.
    let folder = tempfile::tempdir().unwrap();
    let mut rig = rig();
    for (place, diagnoser) in rig.diagnosers.iter_mut().enumerate() {
        diagnoser.state.directory = Some(folder.path().join(place.to_string()));
    }
    let mut before = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    status(&observer, |_| true).await;
    let mut next = 1;
    // On a busy machine they may be side by side for so long that it is right to report them: then again.
    let after = loop {
        let begun = Instant::now();
        let after = rig.start_diagnoser(next);
        both_have_heard_of_each_other(&observer).await;
        before.stop().await;
        if begun.elapsed() < NOT_ENDING {
            break after;
        }
        before = after;
        next = 1 - next;
    };
    let statuses = observer.declare_subscriber("trusswatch/*/lower/status").await.unwrap();
    // For longer than it would take to report another process.
    for count in 0..40 {
        let received = in_time("a status", statuses.recv_async()).await.unwrap();
        let status: ModuleStatus = vocabulary::decode(&received.payload().to_bytes()).unwrap();
        assert!(!status.another_process, "status {count}");
    }
    after.stop().await;
    session::close(&observer).await;
}
