//! Two processes that run as the same module notice each other, and an observer notices both.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod support;

use std::time::Duration;

use daemon::config::PlantFlags;
use observer::{ModulePicture, present};
use support::{Rig, in_time, status};
use wire::ModuleStatus;
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
async fn seen(observer: &Session) -> ModulePicture {
    let expected = ["lower".parse().unwrap()];
    let picture = present(observer, None, &expected, Duration::from_secs(5));
    let mut modules = picture.await.unwrap().modules;
    modules.retain(|module| module.member.module.as_str() == "lower");
    modules.remove(0)
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

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_predecessor_that_ends_is_not_another_process() {
    let rig = rig();
    let before = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    status(&observer, |_| true).await;
    let after = rig.start_diagnoser(1);
    tokio::time::sleep(Duration::from_secs(1)).await;
    before.stop().await;
    let statuses = observer.declare_subscriber("trusswatch/*/lower/status").await.unwrap();
    let end = tokio::time::Instant::now() + Duration::from_secs(4);
    let mut count = 0;
    while let Ok(received) = tokio::time::timeout_at(end, statuses.recv_async()).await {
        let status: ModuleStatus = wire::decode(&received.unwrap().payload().to_bytes()).unwrap();
        assert!(!status.another_process, "status {count}");
        count += 1;
    }
    assert!(count > 10, "only {count} statuses");
    after.stop().await;
    session::close(&observer).await;
}
