//! What was recorded gives the same verdicts again, bit for bit: of every kind of fault, over a network that loses
//! packets, and across the restart of a diagnoser.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use daemon::config::Schedule;
use nix::sys::signal::Signal;
use recording::Recording;
use serde_json::Value;
use system_tests::cut_link::CutLink;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::lab::{Impairment, Lab, Node};
use system_tests::observer::Observer;
use system_tests::plant_clock::PlantClock;
use system_tests::process::Process;
use system_tests::recorder::Recorder;
use system_tests::scenarios::{self, ONSET, STEPS};
use system_tests::{in_time, turn};
use vocabulary::{FaultTransition, ModuleStatus, RunId, fault::Fault};

const RUN: RunId = RunId(7);
/// How long a link is cut: beyond the last sample.
const CUT_FOR: Duration = Duration::from_millis(800);

/// A deployment that is being recorded from its first sample on.
struct Recorded {
    recorder: Recorder,
    diagnosers: Vec<Process>,
    plant: Process,
    observer: Observer,
    deployment: Deployment,
}

impl Recorded {
    /// The plant begins when its diagnosers are there, which the recorder hears by then.
    async fn raise(deployment: Deployment, speed: &str, steps: u64, seed: u64) -> Self {
        let diagnosers = deployment.start_diagnosers();
        let recorder = Recorder::start(&deployment);
        recorder.hears(&MODULES).await;
        let observer = Observer::of(&deployment).await;
        let plant = deployment.start_plant(speed, steps, seed, RUN);
        Self { recorder, diagnosers, plant, observer, deployment }
    }

    /// Waits for the last step, ends everything, and has the recording verified.
    async fn verify(mut self) -> Verified {
        assert_eq!(self.plant.exit_code().await, Some(0), "{}", self.plant.log());
        for diagnoser in self.diagnosers {
            diagnoser.stop().await;
        }
        self.recorder.end().await;
        self.observer.session.close().await.unwrap();
        let ended = self.recorder.replay(&["--verify", "--json"]).await;
        assert_eq!(ended.code, Some(0), "{ended:?}\n{}", self.deployment.logs());
        Verified::of(&ended.json())
    }
}

/// How much was compared.
#[derive(Debug)]
struct Verified {
    processes: usize,
    verdicts: u64,
    divergences: u64,
}

impl Verified {
    /// Everything that was recorded has been compared.
    fn of(report: &Value) -> Self {
        let modules = report["modules"].as_array().unwrap();
        let processes = modules.iter().flat_map(|one| one["processes"].as_array().unwrap());
        let mut all = Self { processes: 0, verdicts: 0, divergences: 0 };
        for process in processes {
            let count = |what: &str| process[what].as_u64().unwrap();
            assert!(process["shortfall"].is_null(), "{}", process["shortfall"]);
            assert_eq!(count("verdicts_not_verified") + count("divergences_not_verified"), 0);
            all.processes += 1;
            all.verdicts += count("verdicts_same");
            all.divergences += count("divergences_same");
        }
        all
    }
}

fn with_effects() -> Schedule {
    scenarios::single("module2/sensor/g1", Fault::Bias { offset_m: -6e-4 })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn of_every_kind_of_fault() {
    let _turn = turn::side_by_side().await;
    for (seed, schedule) in (300..).zip(scenarios::all()) {
        let deployment = Deployment::of_tower(&schedule);
        let verified = Recorded::raise(deployment, "max", STEPS, seed).await.verify().await;
        assert!(verified.verdicts > 0 && verified.divergences > 20, "{schedule:?} {verified:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs root and network namespaces: part of the check"]
async fn over_a_network_that_loses_packets() {
    let _turn = turn::alone().await;
    let lab = Arc::new(Lab::start(900).unwrap());
    let deployment = Deployment::in_lab(&with_effects(), Arc::clone(&lab));
    // The recorder's links too.
    for (from, to) in Node::pairs() {
        lab.impair(from, to, Impairment::loss(0.05));
    }
    let recorded = Recorded::raise(deployment, "real", ONSET + 1500, 900).await;
    let verified = recorded.verify().await;
    println!("over a network that loses 5 %: {verified:?}");
    assert!(verified.verdicts > 0, "{verified:?}");
}

/// Samples near the end find no way to the recorder and are dropped; no later ones follow that would show it.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "needs root and network namespaces: part of the check"]
async fn the_last_samples_of_a_run_are_recorded_though_their_link_was_cut() {
    let _turn = turn::alone().await;
    let lab = Arc::new(Lab::start(902).unwrap());
    let deployment = Deployment::in_lab(&with_effects(), Arc::clone(&lab));
    let last = ONSET + 1500;
    let recorded = Recorded::raise(deployment, "real", last, 902).await;
    let clock = PlantClock::of(&recorded.observer).await;
    clock.reach(RUN, last - 600).await;
    // The clock ticks over the same link.
    lab.impair(Node::Plant, Node::Observer, Impairment::cut());
    tokio::time::sleep(CUT_FOR).await;
    lab.heal();
    let verified = recorded.verify().await;
    println!("with a link that was cut near the end: {verified:?}");
    assert!(verified.verdicts > 0, "{verified:?}");
}

/// It hears what the diagnosers have taken, and the plant still has it.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recorder_that_reaches_the_plant_after_its_last_sample_fetches_all() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    deployment.patient_but_for_leases();
    let link = CutLink::to(&deployment.endpoints[0]).await;
    link.cut();
    let diagnosers = deployment.start_diagnosers();
    let recorder = Recorder::start_through(&deployment, 0, &link);
    recorder.hears(&MODULES).await;
    let observer = Observer::of(&deployment).await;
    let plant = deployment.start_plant("max", STEPS, 907, RUN);
    PlantClock::of(&observer).await.reach(RUN, STEPS - 1).await;
    link.mend();
    let recorded = Recorded { recorder, diagnosers, plant, observer, deployment };
    let verified = recorded.verify().await;
    assert!(verified.verdicts > 0 && verified.divergences > 20, "{verified:?}");
}

/// None came that would show what is missing, but the diagnosers say what they have taken.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn of_a_plant_out_of_reach_every_sample_is_counted_as_lost() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    let diagnosers = deployment.start_diagnosers();
    let mut recorder = Recorder::start_at(&deployment, &deployment.endpoints[1..]);
    recorder.hears(&MODULES).await;
    let mut plant = deployment.start_plant("max", STEPS, 906, RUN);
    assert_eq!(plant.exit_code().await, Some(0), "{}", plant.log());
    for diagnoser in diagnosers {
        diagnoser.stop().await;
    }
    recorder.end().await;
    let file = recorder.files().pop().unwrap();
    let metadata = Recording::open(&file).unwrap().metadata().unwrap();
    let losses = metadata.iter().find(|one| one.name == "losses").unwrap();
    for module in MODULES {
        let lost = losses.values.get(&format!("trusswatch/tower/{module}/sample"));
        let lost: u64 = lost.map_or(0, |count| count.parse().unwrap());
        // Those before the first progress count as published before the recorder started.
        assert!((STEPS - 500..=STEPS).contains(&lost), "{lost} {}", recorder.process().log());
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn across_the_restart_of_a_diagnoser() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    let mut recorded = Recorded::raise(deployment, "real", ONSET + 3000, 901).await;
    let clock = PlantClock::of(&recorded.observer).await;
    clock.reach(RUN, ONSET + 30).await;
    recorded.diagnosers[1].crash().await;
    recorded.diagnosers[1] = recorded.deployment.start_diagnoser(1);
    let verified = recorded.verify().await;
    println!("across a restart: {verified:?}");
    assert!(verified.verdicts > 0 && verified.processes == 3, "{verified:?}");
}

/// What it did not hear while it was stopped, the publishers still have.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recorder_that_is_paused_fetches_what_it_missed() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    deployment.patient_but_for_leases();
    let recorded = Recorded::raise(deployment, "real", ONSET + 3000, 904).await;
    let clock = PlantClock::of(&recorded.observer).await;
    clock.reach(RUN, ONSET - 200).await;
    recorded.recorder.process().signal(Signal::SIGSTOP);
    clock.reach(RUN, ONSET + 600).await;
    recorded.recorder.process().signal(Signal::SIGCONT);
    let verified = recorded.verify().await;
    println!("with a recorder that was paused: {verified:?}");
    assert!(verified.verdicts > 0, "{verified:?}");
}

/// What was decided before is not in question.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recorder_that_is_started_after_the_restart_of_a_diagnoser() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    let mut diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    let plant = deployment.start_plant("real", ONSET + 4000, 910, RUN);
    let clock = PlantClock::of(&observer).await;
    clock.reach(RUN, ONSET + 500).await;
    diagnosers[1].crash().await;
    diagnosers[1] = deployment.start_diagnoser(1);
    clock.reach(RUN, ONSET + 1500).await;
    let recorder = Recorder::start(&deployment);
    recorder.hears(&MODULES).await;
    let verified = Recorded { recorder, diagnosers, plant, observer, deployment }.verify().await;
    println!("after a restart: {verified:?}");
    assert!(verified.processes == 2 && verified.divergences > 10, "{verified:?}");
}

/// It hears nothing of a whole run, after which no verdict follows that would show what is missing.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recorder_that_is_paused_during_a_run_fetches_its_verdicts() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    deployment.patient_but_for_leases();
    let diagnosers = deployment.start_diagnosers();
    let recorder = Recorder::start(&deployment);
    recorder.hears(&MODULES).await;
    let observer = Observer::of(&deployment).await;
    recorder.process().signal(Signal::SIGSTOP);
    let plant = deployment.start_plant("max", STEPS, 908, RUN);
    let recorded = Recorded { recorder, diagnosers, plant, observer, deployment };
    PlantClock::of(&recorded.observer).await.reach(RUN, STEPS - 1).await;
    recorded.recorder.process().signal(Signal::SIGCONT);
    has_all_verdicts(&recorded.recorder, STEPS - 1).await;
    let verified = recorded.verify().await;
    println!("with a recorder that was paused during a run: {verified:?}");
    assert!(verified.verdicts > 0, "{verified:?}");
}

/// Present states, which are asked for when the link is there again, are not all of them.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn verdicts_while_a_link_is_cut_are_fetched_from_the_journal() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    deployment.patient_but_for_leases();
    let link = CutLink::to(&deployment.endpoints[2]).await;
    let diagnosers = deployment.start_diagnosers();
    let recorder = Recorder::start_through(&deployment, 2, &link);
    recorder.hears(&MODULES).await;
    let observer = Observer::of(&deployment).await;
    let last = ONSET + 4000;
    let plant = deployment.start_plant("real", last + 1, 909, RUN);
    let recorded = Recorded { recorder, diagnosers, plant, observer, deployment };
    let clock = PlantClock::of(&recorded.observer).await;
    clock.reach(RUN, ONSET - 200).await;
    link.cut();
    clock.reach(RUN, ONSET + 800).await;
    link.mend();
    has_all_verdicts(&recorded.recorder, last).await;
    let verified = recorded.verify().await;
    println!("with a link that was cut: {verified:?}");
    assert!(verified.verdicts > 0, "{verified:?}");
}

/// Waits until it has every verdict that the modules' statuses count, as of this step.
async fn has_all_verdicts(recorder: &Recorder, last: u64) {
    let has_all = async {
        loop {
            let messages = recorder.messages();
            let has_all = |module: &&str| {
                let own = |topic: &str| format!("trusswatch/tower/{module}/{topic}");
                let is_own = |one: &&recording::Recorded| one.topic.starts_with(&own("fault/"));
                let verdicts = messages.iter().filter(is_own);
                let verdicts = verdicts
                    .filter_map(|one| vocabulary::decode::<FaultTransition>(&one.payload).ok());
                let numbers: BTreeSet<u64> =
                    verdicts.filter(FaultTransition::is_verdict).map(|one| one.sequence).collect();
                let status = messages.iter().rfind(|one| one.topic == own("status"));
                let status =
                    status.and_then(|one| vocabulary::decode::<ModuleStatus>(&one.payload).ok());
                status.is_some_and(|status| {
                    status.step.is_some_and(|step| step.0 >= last)
                        && numbers.len() as u64 + 1 == status.next_sequence
                })
            };
            if MODULES.iter().all(has_all) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    };
    in_time("every verdict in the recording", has_all).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_recorder_whose_disk_is_full_from_the_start_says_so_and_records_once_it_is_not() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    let diagnosers = deployment.start_diagnosers();
    let (mut recorder, interposer) = Recorder::behind_interposer(&deployment, &["full"]);
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let _plant = deployment.start_plant("real", ONSET + 60_000, 905, RUN);
    let degraded = async {
        while !recorder.process().log().contains("dropping messages until the disk is writable") {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    in_time("the recorder's warning", degraded).await;
    assert_eq!(recorder.bytes(), 0);
    interposer.call_off("full");
    let has_states = async {
        loop {
            let messages = recorder.messages();
            let has_state = |module: &&str| {
                let mut of_module = messages.iter().filter(|one| one.topic.contains(module));
                let is_state = |one: &recording::Recorded| {
                    one.topic.ends_with("/input")
                        && String::from_utf8_lossy(&one.payload).contains("\"state\"")
                };
                // And something after it to be compared.
                of_module.any(is_state) && of_module.any(|one| one.topic.ends_with("/divergence"))
            };
            if MODULES.iter().all(has_state) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    in_time("the diagnosers' states in the recording", has_states).await;
    recorder.end().await;
    // The part of the run from there on.
    let ended = recorder.replay(&["--verify", "--json"]).await;
    assert_eq!(ended.code, Some(0), "{ended:?}");
    for diagnoser in diagnosers {
        diagnoser.stop().await;
    }
}

/// The recorder begins in the middle; and of a recording in several files each one is compared by itself.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_file_by_itself_though_the_recorder_was_started_late() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_tower(&with_effects());
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    let plant = deployment.start_plant("real", ONSET + 12_000, 903, RUN);
    PlantClock::of(&observer).await.reach(RUN, ONSET / 2).await;
    let recorder = Recorder::start_with(&deployment, &["--max-file-mib", "1"]);
    let mut recorded = Recorded { recorder, diagnosers, plant, observer, deployment };
    assert_eq!(recorded.plant.exit_code().await, Some(0), "{}", recorded.plant.log());
    for diagnoser in recorded.diagnosers.drain(..) {
        diagnoser.stop().await;
    }
    recorded.recorder.end().await;
    recorded.observer.session.close().await.unwrap();
    let files = recorded.recorder.files();
    assert!(files.len() > 1, "{files:?}");
    // The last may have ended before it had a state.
    let (mut verdicts, mut parts, last) = (0, 0, files.len() - 1);
    for (place, file) in files.iter().enumerate() {
        let ended = recorded.recorder.replay_files(&[file], &["--verify", "--json"]).await;
        if place == last && ended.code == Some(3) {
            continue;
        }
        let report = ended.json();
        verdicts += Verified::of(&report).verdicts;
        let modules = report["modules"].as_array().unwrap();
        let before =
            |what: &str| modules.iter().map(|one| one[what].as_u64().unwrap()).sum::<u64>();
        assert_eq!(before("divergences_without_process"), 0, "{report}");
        // While the state was on its way, something may have been decided.
        let decided =
            before("verdicts_without_process") + before("identifications_without_process");
        assert_eq!(ended.code, Some(if decided == 0 { 0 } else { 6 }), "{ended:?}");
        // The publisher may still have had all samples since its start.
        let mut processes = modules.iter().flat_map(|one| one["processes"].as_array().unwrap());
        let is_part = processes.any(|one| !one["after"].is_null());
        let other = recorded.recorder.replay_files(&[file], &["--threshold-factor", "1"]).await;
        assert_eq!(other.code, Some(if is_part { 6 } else { 0 }), "{other:?}");
        parts += usize::from(is_part);
    }
    let all = recorded.recorder.replay(&["--verify", "--json"]).await;
    assert_eq!(all.code, Some(0), "{all:?}");
    println!("{} files, {verdicts} verdicts one by one", files.len());
    assert!(parts > 0 && verdicts > 0 && Verified::of(&all.json()).verdicts >= verdicts);
}
