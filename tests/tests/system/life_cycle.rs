//! A fault's life as an operator sees it, with the operator's own program.

use std::time::Duration;

use daemon::config::Schedule;
use nix::sys::signal::Signal;
use serde_json::Value;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::observer::{Faults, Observer};
use system_tests::operate::trusswatch;
use system_tests::plant_clock::PlantClock;
use system_tests::process::Process;
use system_tests::publications::Publications;
use system_tests::signs::{Sign, Signs};
use system_tests::{scenarios, turn};
use vocabulary::{
    ComponentPath, FaultState, FaultTransition, ModulePhase, ModuleStatus, RunId, fault::Fault,
};

const RUN: RunId = RunId(1);
const SEED: u64 = 11;
const GAGE: &str = "module1/sensor/g2";
const OTHER_GAGE: &str = "module1/sensor/g5";
/// More than any test takes.
const FOR_LONG: u64 = 1_000_000;

/// A jump, which needs no peer's answer.
const BIAS: Fault = Fault::Bias { offset_m: 4e-4 };
/// Steps that go on after the plant has stood still.
const AFTERWARDS: u64 = 1000;

/// The tower at work.
struct Works {
    deployment: Deployment,
    observer: Observer,
    faults: Faults,
    clock: PlantClock,
    diagnosers: Vec<Process>,
    plant: Process,
}

impl Works {
    async fn start(deployment: Deployment) -> Self {
        let observer = Observer::of(&deployment).await;
        let faults = observer.faults().await;
        let clock = PlantClock::of(&observer).await;
        let diagnosers = deployment.start_diagnosers();
        observer.wait_for(&MODULES, false).await;
        let plant = deployment.start_plant("real", FOR_LONG, SEED, RUN);
        Self { deployment, observer, faults, clock, diagnosers, plant }
    }

    async fn transition(&mut self, component: &str, state: FaultState) -> FaultTransition {
        let path: ComponentPath = component.parse().unwrap();
        let wanted = |_: u64, transition: FaultTransition| {
            let is_wanted = transition.component == path && transition.state() == state;
            is_wanted.then_some(transition)
        };
        self.faults.find(&format!("{component} {state}"), wanted).await
    }

    /// What `trusswatch faults --json` shows.
    async fn picture(&self) -> Value {
        let ended = trusswatch(&self.deployment, &["faults", "--json"]).await;
        assert_eq!(ended.code, Some(0), "{ended:?}");
        ended.json()
    }

    async fn state(&self, component: &str) -> Value {
        let picture = self.picture().await;
        let components = picture["components"].as_array().unwrap();
        let shown = components.iter().find(|shown| shown["component"] == component);
        shown.map_or(Value::Null, |shown| shown["state"].clone())
    }

    async fn end(self) {
        self.plant.stop().await;
        for process in self.diagnosers {
            process.stop().await;
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_fault_is_acknowledged_and_reset_and_the_history_records_by_whom_and_why() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&scenarios::single(GAGE, BIAS));
    deployment.patient();
    let mut works = Works::start(deployment).await;
    works.transition(GAGE, FaultState::Latched).await;
    assert_eq!(works.state(GAGE).await, "latched");

    let reset = ["reset", GAGE, "--by", "ben"];
    let refused = trusswatch(&works.deployment, &reset).await;
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.err.contains("is not acknowledged"), "{refused:?}");

    let ack = ["ack", GAGE, "--by", "ada", "--note", "looks loose"];
    let acknowledged = trusswatch(&works.deployment, &ack).await;
    assert_eq!(acknowledged.code, Some(0), "{acknowledged:?}");
    assert_eq!(works.state(GAGE).await, "acknowledged");
    let check = trusswatch(&works.deployment, &["faults", "--exit-code"]).await;
    assert_eq!(check.code, Some(1), "{check:?}");

    works.diagnosers[0].crash().await;
    works.observer.wait_until_gone("module1").await;
    works.diagnosers[0] = works.deployment.start_diagnoser(0);
    works.observer.wait_for(&MODULES, false).await;
    assert_eq!(works.state(GAGE).await, "acknowledged");

    let refused = trusswatch(&works.deployment, &reset).await;
    assert_eq!(refused.code, Some(1), "{refused:?}");
    let reasons = [
        "is still changing",
        "changed a moment ago",
        "still departs from its reference",
        "has not been compared with its reference",
    ];
    assert!(reasons.iter().any(|reason| refused.err.contains(reason)), "{refused:?}");

    works.observer.inject(GAGE, None).await;
    let mut waiting = reset.to_vec();
    waiting.extend(["--note", "new plug", "--wait", "60"]);
    let reset = trusswatch(&works.deployment, &waiting).await;
    assert_eq!(reset.code, Some(0), "{reset:?}");
    assert_eq!(works.state(GAGE).await, Value::Null, "normal ones are not shown");

    let history = trusswatch(&works.deployment, &["history", "--json"]).await;
    assert_eq!(history.code, Some(0), "{history:?}");
    check_history(&history.json());
    works.end().await;
}

fn check_history(history: &Value) {
    assert_eq!(history["gaps"], Value::Array(vec![]), "{history:#}");
    assert_eq!(history["silent"], Value::Array(vec![]), "{history:#}");
    let transitions = history["transitions"].as_array().unwrap();
    let own: Vec<&Value> = transitions.iter().filter(|item| item["component"] == GAGE).collect();
    let states: Vec<&Value> = own.iter().map(|item| &item["state"]).collect();
    assert_eq!(states, ["tentative", "latched", "acknowledged", "normal"], "{history:#}");
    for (item, order, by, note) in
        [(own[2], "acknowledge", "ada", "looks loose"), (own[3], "reset", "ben", "new plug")]
    {
        let given = &item["order"];
        assert_eq!((&given["order"], &given["by"]), (&order.into(), &by.into()), "{item:#}");
        assert_eq!(given["note"], note, "{item:#}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_diagnoser_is_refused_the_state_directory() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&Schedule::default());
    let observer = Observer::of(&deployment).await;
    let mut diagnosers = deployment.start_diagnosers();
    observer.wait_for(&MODULES, false).await;
    let mut second = deployment.start_diagnoser(0);
    let code = second.exit_code().await;
    assert_eq!(code, Some(1), "{}", second.log());
    let log = second.log();
    let complaint = log.lines().find(|line| line.starts_with("error:")).unwrap();
    let directory = deployment.state_directory(0);
    assert!(complaint.contains(directory.to_str().unwrap()), "{complaint}");
    let holder = format!("process {}", diagnosers[0].pid());
    assert!(complaint.contains(&holder), "{complaint}, not {holder}");
    assert!(diagnosers[0].is_running());
    for process in diagnosers {
        process.stop().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stopped_plant_is_reported_and_is_no_fault() {
    let _turn = turn::side_by_side().await;
    // So long that a busy machine does not make the plant pause as well.
    let after = a_stopped_plant(3000).await;
    println!("stale {after:?} after the last sample");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "measures time: wants both cores for itself"]
async fn a_stopped_plant_is_reported_within_a_second() {
    let _turn = turn::alone().await;
    for after in a_stopped_plant(500).await {
        println!("stale {after:?} after the last sample");
        assert!(after < Duration::from_secs(1), "stale only after {after:?}");
    }
}

/// Zenoh then gives up the opening of a link in its very last moment, now and then after the link is open on one side.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes minutes: thirty pauses of seven seconds"]
async fn a_plant_that_stands_still_as_long_as_opening_a_link_takes_is_found_again() {
    let _turn = turn::alone().await;
    let works = Works::start(Deployment::of_watched_tower(&Schedule::default())).await;
    let in_service = |status: &ModuleStatus| status.phase == ModulePhase::InService;
    let stale = |status: &ModuleStatus| status.phase == ModulePhase::Stale;
    for pause in 0..30 {
        for module in MODULES {
            works.observer.status_of(module, in_service).await;
        }
        let longest = u64::from(session::DEFAULT_LEASE_MS) + session::OPENING_MS;
        works.plant.signal(Signal::SIGSTOP);
        let stopped = tokio::time::Instant::now();
        for module in MODULES {
            works.observer.status_of(module, stale).await;
        }
        // The attempt begins some milliseconds after the end of the lease.
        tokio::time::sleep_until(stopped + Duration::from_millis(longest + pause % 10)).await;
        works.plant.signal(Signal::SIGCONT);
    }
    for module in MODULES {
        works.observer.status_of(module, in_service).await;
    }
    let is_closed = |line: &&str| line.contains("open on one side only: closed");
    let closed: usize = works
        .diagnosers
        .iter()
        .map(|process| process.log().lines().filter(is_closed).count())
        .sum();
    println!("{closed} links of 60 were open on one side only");
    works.end().await;
}

/// Stops the plant of modules that are stale after so many milliseconds without a sample, and lets it go on; returns
/// how long after its last sample each module was stale.
async fn a_stopped_plant(stale_after_ms: i64) -> Vec<Duration> {
    let deployment = Deployment::of_watched_tower(&Schedule::default());
    for place in 1..=MODULES.len() {
        deployment.set(place, "input", "stale_after_ms", stale_after_ms);
        deployment.set(place, "input", "resync_after_ms", 60_000);
    }
    let mut works = Works::start(deployment).await;
    let publications = Publications::of(&works.observer).await;
    let mut signs = Vec::new();
    for module in MODULES {
        signs.push(Signs::of(&works.observer, module).await);
    }
    let mut silences = Vec::new();
    for module in MODULES {
        let in_service = |status: &ModuleStatus| status.phase == ModulePhase::InService;
        let status = works.observer.status_of(module, in_service).await;
        silences.push(status.intake.silences);
    }
    works.plant.signal(Signal::SIGSTOP);
    let entered = |phase| {
        move |at, sign: Sign| match sign {
            Sign::Phase(change) if change.phase == phase => Some((at, change)),
            _ => None,
        }
    };
    let mut stale = Vec::new();
    for signs in &mut signs {
        let (at, change) = signs.find("staleness", entered(ModulePhase::Stale)).await;
        assert_eq!(change.before, Some(ModulePhase::InService));
        stale.push((at, change));
    }
    let picture = works.picture().await;
    let phases: Vec<&Value> =
        picture["modules"].as_array().unwrap().iter().map(|module| &module["phase"]).collect();
    assert_eq!(phases, ["stale", "stale"], "{picture:#}");
    let components = picture["components"].as_array().unwrap();
    let unknown = components.iter().filter(|component| {
        let reason = component["unknown"]["reason"].as_str().unwrap_or_default();
        component["state"] == "unknown" && reason.starts_with("no sample since 20")
    });
    assert_eq!((unknown.count(), components.len()), (24, 24), "{picture:#}");
    let check = trusswatch(&works.deployment, &["faults", "--exit-code"]).await;
    assert_eq!(check.code, Some(1), "{check:?}");
    assert!(check.out.contains("STALE") && check.out.contains("0 of 24"), "{check:?}");

    works.plant.signal(Signal::SIGCONT);
    for signs in &mut signs {
        signs.find("service", entered(ModulePhase::InService)).await;
    }
    let still_at = works.clock.step(RUN).unwrap();
    for ((module, process), before) in MODULES.into_iter().zip(&works.diagnosers).zip(silences) {
        let beyond = |status: &ModuleStatus| status.step > Some(still_at.plus(AFTERWARDS));
        let status = works.observer.status_of(module, beyond).await;
        assert_eq!(status.diagnosis.samples_missing, 0, "{module}\n{}", process.log());
        assert_eq!(status.intake.silences, before + 1, "{module}");
    }
    let arrived = works.faults.arrived();
    assert!(arrived.is_empty(), "silence was taken for a change: {arrived:#?}");
    // Only now: the plant may have been stopped before its last sample had left to the observer too.
    let mut stale_after = Vec::new();
    for (at, change) in stale {
        let last = publications.time_of(&change.module, change.step.unwrap()).await;
        stale_after.push(Duration::from_nanos(at.saturating_sub(last)));
    }
    works.end().await;
    stale_after
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unwritable_journal_is_reported_and_catches_up() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&scenarios::single(GAGE, BIAS));
    deployment.patient();
    let directory = deployment.state_directory(0);
    std::fs::remove_dir(&directory).unwrap();
    std::fs::write(&directory, "in the way").unwrap();
    let mut works = Works::start(deployment).await;
    let status = works.observer.status_of("module1", |_| true).await;
    assert!(status.journal.problem.is_some(), "{:?}", status.journal);

    let latched = works.transition(GAGE, FaultState::Latched).await;
    assert!(!latched.durable, "{latched:?}");
    let picture = works.picture().await;
    let modules = picture["modules"].as_array().unwrap();
    let first = modules.iter().find(|module| module["module"] == "module1").unwrap();
    assert!(first["journal"]["problem"].is_string(), "{picture:#}");
    assert_eq!(first["phase"], "in_service", "diagnosis goes on");

    std::fs::remove_file(&directory).unwrap();
    let caught_up = |status: &vocabulary::ModuleStatus| {
        status.journal.problem.is_none() && status.journal.unsaved == 0
    };
    works.observer.status_of("module1", caught_up).await;
    let history = trusswatch(&works.deployment, &["history", "--json"]).await.json();
    assert_eq!(history["gaps"], Value::Array(vec![]), "{history:#}");
    let transitions = history["transitions"].as_array().unwrap();
    let kept = |item: &Value| item["component"] == GAGE && item["state"] == "latched";
    assert!(transitions.iter().any(kept), "{history:#}");

    works.observer.inject(OTHER_GAGE, Some(BIAS)).await;
    let later = works.transition(OTHER_GAGE, FaultState::Latched).await;
    assert!(later.durable, "{later:?}");
    works.end().await;
}
