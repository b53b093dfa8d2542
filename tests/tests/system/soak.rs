//! Hours of the plant's time without a fault, in processes and in one: memory stays flat, nothing
//! drifts, no heartbeat is missed, no false alarm is raised.

use std::time::{Duration, Instant};

use daemon::config::Schedule;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::observer::{Faults, Observer};
use system_tests::process::Process;
use system_tests::soak::{Heartbeat, Heartbeats, Memory, Stalls};
use system_tests::turn;
use vocabulary::{RunId, Step};

const STEPS_PER_HOUR: f64 = 3.6e6;
const EVERY: Duration = Duration::from_millis(200);
const LONGEST_GAP: Duration = Duration::from_secs(2);
const LARGEST_LAG_MS: f64 = 1000.0;
/// Permitted growth from the first quarter to the last, as a share of the first.
const GROWTH: f64 = 0.1;
/// Nothing happens, so that nothing is to be remembered but how far the module has watched.
const STATE_BYTES: u64 = 1 << 16;

/// Hours of the plant's time, from the environment.
fn steps() -> u64 {
    let hours = std::env::var("SOAK_HOURS").map_or(1.0, |text| text.parse().unwrap());
    (hours * STEPS_PER_HOUR) as u64
}

/// Everything that is watched while the processes run.
struct Soak {
    deployment: Deployment,
    processes: Vec<(&'static str, Process, Memory)>,
    heartbeats: Heartbeats,
    stalls: Stalls,
    observer: Observer,
    faults: Faults,
    started: Instant,
}

impl Soak {
    async fn begin(steps: u64) -> Self {
        let deployment = Deployment::of_tower(&Schedule::default());
        deployment.publish_as_shipped();
        let diagnosers = deployment.start_diagnosers();
        let observer = Observer::of(&deployment).await;
        observer.wait_for(&MODULES, false).await;
        let stalls = Stalls::watched();
        let heartbeats = Heartbeats::of(&observer, &stalls).await;
        let faults = observer.faults().await;
        let plant = deployment.start_plant("max", steps, 2026, RunId(1));
        let named = ["plant", MODULES[0], MODULES[1]].into_iter();
        let processes = named.zip([plant].into_iter().chain(diagnosers));
        let processes = processes.map(|(name, process)| (name, process, Memory::default()));
        Self {
            processes: processes.collect(),
            started: Instant::now(),
            deployment,
            heartbeats,
            stalls,
            observer,
            faults,
        }
    }

    /// Monitors until the plant has ended.
    async fn watch(&mut self) {
        let mut tell_at = Duration::from_secs(30);
        loop {
            tokio::time::sleep(EVERY).await;
            if let Some(status) = self.processes[0].1.ended() {
                assert_eq!(status.code(), Some(0), "{}", self.deployment.logs());
                return;
            }
            self.look();
            if self.started.elapsed() > tell_at {
                self.report();
                tell_at += Duration::from_secs(30);
            }
        }
    }

    fn look(&mut self) {
        for (_, process, memory) in &mut self.processes {
            memory.sample(process.pid());
        }
        for heartbeat in self.heartbeats.modules().values() {
            let age = heartbeat.age(&self.stalls);
            let module = &heartbeat.latest.module;
            assert!(age < LONGEST_GAP, "no status of {module} for {age:?}");
        }
        let arrived = self.faults.arrived();
        assert!(arrived.is_empty(), "false alarms: {arrived:#?}");
    }

    fn report(&self) {
        let seconds = self.started.elapsed().as_secs_f64();
        let heartbeats = self.heartbeats.modules();
        let steps = heartbeats.values().map(|h| h.step().0).min().unwrap_or(0);
        let memory = self
            .processes
            .iter()
            .map(|(name, _, memory)| format!("{name} {:.1} MiB", memory.latest_mib()));
        println!(
            "{seconds:6.0} s: {:6.2} h of the plant ({:.0} steps/s), {}, gaps {:?}, lag {:.1} ms",
            steps as f64 / STEPS_PER_HOUR,
            steps as f64 / seconds,
            memory.collect::<Vec<_>>().join(", "),
            heartbeats.values().map(|h| h.longest_gap).max().unwrap_or_default(),
            heartbeats.values().map(|h| h.largest_lag_ms).fold(0.0, f64::max),
        );
    }

    /// Waits until every module has reported the last step, and checks everything.
    async fn end(self, steps: u64) {
        let mut heartbeats = Vec::new();
        for module in MODULES {
            let module = module.parse().unwrap();
            heartbeats.push(self.heartbeats.up_to(&module, Step(steps - 1)).await);
        }
        self.report();
        for (name, _, memory) in &self.processes {
            let quarters = memory.quarters_mib();
            println!("{name}: {quarters:.1?} MiB at most in each quarter");
            assert!(quarters[3] <= (1.0 + GROWTH) * quarters[0], "{name} grows: {quarters:?}");
        }
        for ((place, module), heartbeat) in (1..).zip(MODULES).zip(&heartbeats) {
            check(heartbeat, steps);
            let bytes = self.deployment.state_bytes(place);
            assert!(bytes <= STATE_BYTES, "{module} keeps {bytes} bytes");
        }
        for (_, process, _) in self.processes.into_iter().skip(1) {
            process.stop().await;
        }
        session::close(&self.observer.session).await;
    }
}

/// Checks a module's statuses.
fn check(heartbeat: &Heartbeat, steps: u64) {
    let Heartbeat { latest, count, longest_gap, largest_lag_ms, most_queued, standstills, .. } =
        heartbeat;
    let module = &latest.module;
    println!(
        "{module}: {count} status messages, at most {longest_gap:.0?} apart, lag at most \
         {largest_lag_ms:.1} ms, at most {most_queued} samples waiting"
    );
    println!("{module}: {:?}", latest.diagnosis);
    assert!(*longest_gap < LONGEST_GAP, "{module}: {longest_gap:?} without a status");
    assert!(*largest_lag_ms < LARGEST_LAG_MS, "{module}: a lag of {largest_lag_ms} ms");
    // the plant's end is one, and a change of phase is published at once
    assert!(*standstills <= 4, "{module} got no further {standstills} times");
    let expected = vocabulary::Counters { samples: steps, runs: 1, ..Default::default() };
    // Peers are queried every fifth second, and when a window comes near a threshold: now and then.
    let asked = latest.diagnosis.questions_asked as f64 * STEPS_PER_HOUR / steps as f64;
    assert!((700.0..=780.0).contains(&asked), "{module}: {asked} queries an hour");
    let found = vocabulary::Counters { answers_given: 0, questions_asked: 0, ..latest.diagnosis };
    assert_eq!(found, expected, "{module}");
    let intake = latest.intake;
    assert_eq!((intake.received, intake.dropped, intake.resynchronised), (steps, 0, 0));
    assert_eq!((latest.latched, latest.unconfirmed, latest.next_sequence), (0, 0, 1));
    assert_eq!(latest.journal.problem, None);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes minutes: SOAK_HOURS of the plant's time, part of the nightly check"]
async fn hours_in_processes() {
    let _turn = turn::alone().await;
    let steps = steps();
    let mut soak = Soak::begin(steps).await;
    soak.watch().await;
    soak.end(steps).await;
}

#[test]
#[ignore = "24 hours of the plant's time in one process take about eleven minutes"]
fn a_day_in_one_process() {
    let _turn = turn::blocking_alone();
    let deployment = Deployment::of_tower(&Schedule::default());
    deployment.publish_as_shipped();
    let config = deployment.plant_config(2026);
    let setups = deployment.diagnoser_configs().iter().map(|c| c.module_setup()).collect();
    let plant = config.make_plant().unwrap();
    let mut rig = study::Rig::new(plant, setups, Vec::new(), RunId(1)).unwrap();
    let mut memory = Memory::default();
    const HOUR: u64 = STEPS_PER_HOUR as u64;
    for _ in 0..24 * 60 {
        rig.run(HOUR / 60).unwrap();
        memory.sample(std::process::id());
        let occurrences = rig.take_occurrences();
        assert!(occurrences.is_empty(), "{occurrences:#?}");
    }
    let quarters = memory.quarters_mib();
    println!("{quarters:.1?} MiB at most in each quarter");
    assert!(quarters[3] <= (1.0 + GROWTH) * quarters[0], "it grows: {quarters:?}");
    for diagnoser in rig.diagnosers() {
        let counters = diagnoser.counters();
        assert_eq!((counters.samples, counters.restarts, counters.changes), (24 * HOUR, 0, 0));
    }
}
