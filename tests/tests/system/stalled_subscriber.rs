//! A client subscribes to everything, connected to the plant and to every diagnoser, and receives nothing
//! for a minute, while faults come and go: no diagnoser's samples get old, none is lost, and other
//! subscribers receive every fault message. And of twenty such clients sixteen are cut off in the same instant.

use std::collections::BTreeSet;

use daemon::config::{Schedule, ScheduledFault};
use system_tests::deployment::Deployment;
use system_tests::observer::{Faults, Observer};
use system_tests::onlooker::{Onlooker, Stall};
use system_tests::process::Process;
use system_tests::publications::Publications;
use system_tests::quantiles::quantiles;
use system_tests::turn;
use system_tests::worst::WorstStatus;
use vocabulary::{FaultState, FaultTransition, RunId, Step, fault::Fault};

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
        if message.state() == FaultState::Latched {
            let component = message.component.to_string();
            assert!(expected.contains(&component), "{component} is healthy");
            found.insert(component);
            messages.push((arrival, message));
        }
    }
    messages
}

/// The tower at work in real time, and what is noted of it.
struct Works {
    deployment: Deployment,
    observer: Observer,
    publications: Publications,
    faults: Faults,
    diagnosers: Vec<Process>,
    plant: Process,
}

impl Works {
    async fn start() -> Self {
        let deployment = talkative();
        let diagnosers = deployment.start_diagnosers();
        let observer = Observer::of(&deployment).await;
        observer.wait_for(&MODULES, false).await;
        let publications = Publications::of(&observer).await;
        let faults = observer.faults().await;
        let plant = deployment.start_plant("real", PLANT_STEPS, 5, RunId(5));
        Self { deployment, observer, publications, faults, diagnosers, plant }
    }

    async fn onlooker(&self, stall: Stall) -> Onlooker {
        let program = env!("CARGO_BIN_EXE_onlooker");
        Onlooker::stalled(program, &self.deployment.endpoints, stall).await
    }

    /// Until a step, no module's samples got old and none was lost, nor was an event.
    async fn nobody_falls_behind(&self, until: Step, worst: &WorstStatus, what: &str) {
        for module in MODULES {
            let status = self.observer.status_of(module, |status| status.step >= Some(until)).await;
            let worst = worst.of_module(module);
            println!("{what}: {module}: {worst:?}, {:?}", status.peers);
            assert!(worst.sample_age_ms < OLDEST_MS, "{module}: {worst:?}");
            assert_eq!(status.intake.dropped, 0, "{module}");
            assert_eq!(status.diagnosis.samples_missing, 0, "{module}");
            assert_eq!(status.publisher.events_lost, 0, "{module}");
        }
    }

    async fn stop(self) {
        self.plant.stop().await;
        for process in self.diagnosers {
            process.stop().await;
        }
    }
}

async fn endure(stall: Stall) {
    let mut works = Works::start().await;
    for module in MODULES {
        works.observer.status_of(module, |status| status.in_service_since_step.is_some()).await;
    }
    let worst = WorstStatus::of(&works.observer).await;
    let onlooker = works.onlooker(stall).await;
    let messages = latched(&mut works.faults).await;
    let delays: Vec<f64> = works.publications.delays_ms(&messages).await;
    println!("{stall:?}: delays of the fault messages, one by one [ms]: {delays:.1?}");
    let [p50, p99] = quantiles(delays, [0.5, 0.99]);
    println!("{stall:?}: fault messages after {p50:.2} ms (p50), {p99:.2} ms (p99)");
    works.nobody_falls_behind(Step(STEPS), &worst, &format!("{stall:?}")).await;
    drop(onlooker);
    works.stop().await;
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
    let mut works = Works::start().await;
    let mut clients = Vec::new();
    for _ in 0..CLIENTS {
        clients.push(works.onlooker(Stall::Later).await);
    }
    let begin = works.observer.status_of("module1", |status| status.step.is_some()).await;
    let begin = begin.step.unwrap();
    let worst = WorstStatus::of(&works.observer).await;
    clients[..CUT_OFF].iter().for_each(Onlooker::cut_off);
    // The leases end within seconds, and the closing of the links after them; faults go on meanwhile.
    let end = Step(begin.0 + 20_000);
    let mut messages = Vec::new();
    while messages
        .last()
        .is_none_or(|(_, message): &(u64, FaultTransition)| message.decided_step < Some(end))
    {
        let (arrival, message) = works.faults.next().await;
        if message.state() == FaultState::Latched && message.decided_step > Some(begin) {
            messages.push((arrival, message));
        }
    }
    let delays = works.publications.delays_ms(&messages).await;
    println!("sixteen of twenty cut off: delays of the fault messages [ms]: {delays:.1?}");
    works.nobody_falls_behind(end, &worst, "sixteen of twenty cut off").await;
    assert!(messages.len() >= 3, "{messages:?}");
    drop(clients);
    works.stop().await;
}
