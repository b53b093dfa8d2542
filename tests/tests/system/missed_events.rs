//! What is published while a subscriber's link is cut, it gets afterwards, in order and once; and no publisher keeps anything
//! that could be asked for past the module's own bounds.

use daemon::config::Schedule;
use session::Network;
use system_tests::cut_link::CutLink;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::in_time;
use system_tests::observer::{Faults, Observer, unix_ns};
use system_tests::turn;
use vocabulary::{FaultState, RunId, fault::Fault};
use zenoh::query::{ConsolidationMode, QueryTarget};

const RUN: RunId = RunId(9);
/// More than any test takes.
const STEPS: u64 = 1_000_000;
/// Before, during and after the cut.
const FAULTY: [&str; 3] = ["module1/sensor/g2", "module1/sensor/g4", "module1/sensor/g6"];
const BIAS: Fault = Fault::Bias { offset_m: 4e-4 };
const QUERIES: usize = 200;

/// The numbers of module 1 that arrive until this component is latched.
async fn until_latched(faults: &mut Faults, component: &str) -> Vec<u64> {
    let mut numbers = Vec::new();
    let latched = |_, transition: vocabulary::FaultTransition| {
        if transition.module.as_str() == MODULES[0] {
            numbers.push(transition.sequence);
        }
        let is_it = transition.component.to_string() == component;
        (is_it && transition.state() == FaultState::Latched).then_some(())
    };
    faults.find(&format!("{component} latched"), latched).await;
    numbers
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_subscriber_whose_link_was_cut_misses_nothing() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&Schedule::default());
    deployment.patient();
    let diagnosers = deployment.start_diagnosers();
    let near = Observer::of(&deployment).await;
    near.wait_for(&MODULES, false).await;
    let link = CutLink::to(&deployment.endpoints[1]).await;
    let network = Network::peer_of(&[link.endpoint()]);
    let distant = Observer::through(&network, near.structure.clone()).await;
    distant.wait_for(&MODULES[..1], false).await;
    let (mut all, mut heard) = (near.faults().await, distant.faults().await);
    let plant = deployment.start_plant("real", STEPS, 9, RUN);
    near.wait_until_watching(&MODULES).await;

    near.inject(FAULTY[0], Some(BIAS)).await;
    let mut expected = until_latched(&mut all, FAULTY[0]).await;
    let mut numbers = until_latched(&mut heard, FAULTY[0]).await;
    link.cut();
    distant.wait_until_gone(MODULES[0]).await;
    // What came before the link was cut.
    let arrived = heard.arrived().into_iter().map(|(_, transition)| transition);
    let own = arrived.filter(|transition| transition.module.as_str() == MODULES[0]);
    numbers.extend(own.map(|transition| transition.sequence));
    near.inject(FAULTY[1], Some(BIAS)).await;
    expected.extend(until_latched(&mut all, FAULTY[1]).await);
    assert!(heard.arrived().is_empty(), "the link is cut");
    link.mend();
    numbers.extend(until_latched(&mut heard, FAULTY[1]).await);
    near.inject(FAULTY[2], Some(BIAS)).await;
    expected.extend(until_latched(&mut all, FAULTY[2]).await);
    numbers.extend(until_latched(&mut heard, FAULTY[2]).await);
    assert_eq!(numbers, expected);
    assert_eq!(numbers, (1..=numbers.len() as u64).collect::<Vec<_>>());

    plant.stop().await;
    for process in diagnosers {
        process.stop().await;
    }
}

/// How many questions each module has received, from statuses later than now.
async fn questions(observer: &Observer) -> Vec<u64> {
    let now = unix_ns();
    let mut received = Vec::new();
    for module in MODULES {
        let status = observer.status_of(module, |status| status.time_unix_ns > now).await;
        received.push(status.inquiries.received);
    }
    received
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn queries_for_caches_of_publishers_reach_nobody() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&Schedule::default());
    deployment.patient();
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let mut faults = observer.faults().await;
    let plant = deployment.start_plant("real", STEPS, 9, RUN);
    observer.wait_until_watching(&MODULES).await;
    observer.inject(FAULTY[0], Some(BIAS)).await;
    until_latched(&mut faults, FAULTY[0]).await;
    // Now the modules have published everything that they publish. Without samples they ask each other nothing, and who
    // follows events asks nothing either.
    plant.stop().await;
    let before = questions(&observer).await;
    let mut answers = 0;
    for _ in 0..QUERIES {
        let query = observer.session.get("trusswatch/**/@adv/**").target(QueryTarget::All);
        let replies = query.consolidation(ConsolidationMode::None).await.unwrap();
        while in_time("the end of a query", replies.recv_async()).await.is_ok() {
            answers += 1;
        }
    }
    assert_eq!(answers, 0);
    assert_eq!(questions(&observer).await, before, "no module was asked");
    // As it is by a query that does reach them.
    let states = observer.session.get("trusswatch/**/fault/**").target(QueryTarget::All);
    let states = states.consolidation(ConsolidationMode::None).await.unwrap();
    while in_time("the end of a query", states.recv_async()).await.is_ok() {}
    let after = questions(&observer).await;
    assert!(after.iter().zip(&before).all(|(after, before)| after > before), "{after:?}");
    for process in diagnosers {
        process.stop().await;
    }
}
