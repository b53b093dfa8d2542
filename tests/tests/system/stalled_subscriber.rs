//! A client subscribes to everything, connected to the plant and to every diagnoser, and receives nothing
//! for a minute, while faults come and go: no diagnoser's samples get old, none is lost, and other
//! subscribers receive every fault message. And of twenty such clients sixteen are cut off in the same instant.

use std::collections::BTreeSet;

use daemon::config::{Schedule, ScheduledFault};
use names::fault::Fault;
use names::{RunId, Step};
use system_tests::deployment::Deployment;
use system_tests::observer::{Faults, Observer};
use system_tests::onlooker::{Onlooker, Stall};
use system_tests::publications::Publications;
use system_tests::quantiles::quantiles;
use system_tests::turn;
use system_tests::worst::WorstStatus;
use wire::{FaultState, FaultTransition};

/// In real time: how long nothing is taken, and the start before it.
const STEPS: u64 = 60_000 + 3_000;
/// Longer than the test.
const PLANT_STEPS: u64 = 10 * STEPS;
/// No sample that is diagnosed is older \[ms\].
const OLDEST_MS: f64 = 500.0;
const MODULES: [&str; 2] = ["module1", "module2"];

/// The components that become faulty, in turn in both modules.
fn faulty() -> Vec<String> {
    let gages = (1..=6).flat_map(|gage| MODULES.map(|module| format!("{module}/sensor/g{gage}")));
    gages.collect()
}

/// Each is faulty for a while.
fn schedule() -> Schedule {
    let faults = faulty().into_iter().enumerate().map(|(place, component)| ScheduledFault {
        at_step: Step(5000 + 4600 * place as u64),
        until_step: Some(Step(5000 + 4600 * place as u64 + 1500)),
        component: component.parse().unwrap(),
        fault: Fault::Bias { offset_m: 4e-4 },
    });
    Schedule { faults: faults.collect() }
}

/// Every publication, as often as possible, so that the unread ones accumulate soon.
fn talkative() -> Deployment {
    let deployment = Deployment::of_tower(&schedule());
    for place in 1..=MODULES.len() {
        deployment.set(place, "publish", "status_every_ms", 100);
        deployment.set(place, "publish", "divergence_every_steps", 5);
    }
    deployment
}

/// The fault messages until every fault was latched.
async fn latched(faults: &mut Faults) -> Vec<(u64, FaultTransition)> {
    let expected: BTreeSet<String> = faulty().into_iter().collect();
    let mut found = BTreeSet::new();
    let mut messages = Vec::new();
    while found != expected {
        let (arrival, message) = faults.next().await;
        if message.state == FaultState::Latched {
            let component = message.component.to_string();
            assert!(expected.contains(&component), "{component} is healthy");
            found.insert(component);
            messages.push((arrival, message));
        }
    }
    messages
}

async fn endure(stall: Stall) {
    let deployment = talkative();
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let publications = Publications::of(&observer).await;
    let mut faults = observer.faults().await;
    let plant = deployment.start_plant("real", PLANT_STEPS, 5, RunId(5));
    let in_service = |module: &'static str| {
        observer.status(move |status| {
            status.module.as_str() == module && status.in_service_since_step.is_some()
        })
    };
    for module in MODULES {
        in_service(module).await;
    }
    let worst = WorstStatus::of(&observer).await;
    let program = env!("CARGO_BIN_EXE_onlooker");
    let onlooker = Onlooker::stalled(program, &deployment.endpoints, stall).await;
    let messages = latched(&mut faults).await;
    let delays: Vec<f64> = publications.delays_ms(&messages).await;
    println!("{stall:?}: delays of the fault messages, one by one [ms]: {delays:.1?}");
    let [p50, p99] = quantiles(delays, [0.5, 0.99]);
    println!("{stall:?}: fault messages after {p50:.2} ms (p50), {p99:.2} ms (p99)");
    for module in MODULES {
        let done = |status: &wire::ModuleStatus| {
            status.module.as_str() == module && status.step >= Some(Step(STEPS))
        };
        let status = observer.status(done).await;
        let worst = worst.of_module(module);
        println!("{stall:?}: {module}: {worst:?}, {:?}", status.peers);
        assert!(worst.sample_age_ms < OLDEST_MS, "{module}: {worst:?}");
        assert_eq!(status.intake.dropped, 0, "{module}");
        assert_eq!(status.diagnosis.samples_missing, 0, "{module}");
        assert_eq!(status.publisher.events_lost, 0, "{module}");
    }
    drop(onlooker);
    plant.stop().await;
    for process in diagnosers {
        process.stop().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes minutes and a machine of its own: run it with `--ignored`"]
async fn a_callback_that_does_not_return_delays_no_other_client() {
    let _turn = turn::alone().await;
    endure(Stall::Callback).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes minutes and a machine of its own: run it with `--ignored`"]
async fn a_stopped_process_delays_no_other_client() {
    let _turn = turn::alone().await;
    endure(Stall::Process).await;
}

/// Clients, and those of them that are cut off: twice as many as there are threads that read links.
const CLIENTS: usize = 20;
const CUT_OFF: usize = 16;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes a machine of its own: run it with `--ignored`"]
async fn sixteen_dead_links_do_not_deafen_the_others() {
    let _turn = turn::alone().await;
    let deployment = talkative();
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let publications = Publications::of(&observer).await;
    let mut faults = observer.faults().await;
    let plant = deployment.start_plant("real", PLANT_STEPS, 5, RunId(5));
    let program = env!("CARGO_BIN_EXE_onlooker");
    let mut clients = Vec::new();
    for _ in 0..CLIENTS {
        clients.push(Onlooker::stalled(program, &deployment.endpoints, Stall::Later).await);
    }
    let reaches = |module: &'static str, step| {
        observer.status(move |status| status.module.as_str() == module && status.step >= Some(step))
    };
    let begin = reaches("module1", Step(0)).await.step.unwrap();
    let worst = WorstStatus::of(&observer).await;
    clients[..CUT_OFF].iter().for_each(Onlooker::cut_off);
    // The leases end within seconds, and the closing of the links after them; faults go on meanwhile.
    let end = Step(begin.0 + 20_000);
    let mut messages = Vec::new();
    while messages
        .last()
        .is_none_or(|(_, message): &(u64, FaultTransition)| message.decided_step < Some(end))
    {
        let (arrival, message) = faults.next().await;
        if message.state == FaultState::Latched && message.decided_step > Some(begin) {
            messages.push((arrival, message));
        }
    }
    let delays = publications.delays_ms(&messages).await;
    println!("sixteen of twenty cut off: delays of the fault messages [ms]: {delays:.1?}");
    for module in MODULES {
        let status = reaches(module, end).await;
        let worst = worst.of_module(module);
        println!("sixteen of twenty cut off: {module}: {worst:?}, {:?}", status.peers);
        assert!(worst.sample_age_ms < OLDEST_MS, "{module}: {worst:?}");
        assert_eq!(status.intake.dropped, 0, "{module}");
        assert_eq!(status.diagnosis.samples_missing, 0, "{module}");
        assert_eq!(status.publisher.events_lost, 0, "{module}");
    }
    assert!(messages.len() >= 3, "{messages:?}");
    drop(clients);
    plant.stop().await;
    for process in diagnosers {
        process.stop().await;
    }
}
