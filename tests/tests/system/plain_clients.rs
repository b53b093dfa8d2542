//! Generic Zenoh clients query with Zenoh's defaults.

use std::collections::BTreeSet;

use daemon::config::Schedule;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::in_time;
use system_tests::observer::Observer;
use system_tests::turn;
use vocabulary::HistoryPage;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_question_for_all_histories_brings_the_page_of_each_module() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&Schedule { faults: Vec::new() });
    let observer = Observer::of(&deployment).await;
    let diagnosers = deployment.start_diagnosers();
    observer.wait_for(&MODULES, false).await;
    let replies = observer.session.get("trusswatch/*/*/history").await.unwrap();
    let mut pages = BTreeSet::new();
    while let Ok(reply) = in_time("a page", replies.recv_async()).await {
        let sample = reply.into_result().unwrap();
        let page: HistoryPage = vocabulary::decode(&sample.payload().to_bytes()).unwrap();
        let key = format!("trusswatch/{}/{}/history", page.structure, page.module);
        assert_eq!(sample.key_expr().as_str(), key);
        pages.insert(page.module.to_string());
    }
    assert_eq!(pages, BTreeSet::from(MODULES.map(str::to_owned)));
    for process in diagnosers {
        process.stop().await;
    }
}
