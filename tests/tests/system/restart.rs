//! From the start of a diagnoser that was killed to its being in service again: after how many samples, and on a quiet
//! machine how soon.

use system_tests::deployment::{Deployment, MODULES};
use system_tests::observer::{Observer, unix_ns};
use system_tests::plant_clock::PlantClock;
use system_tests::quantiles::quantiles;
use system_tests::signs::{Sign, Signs};
use system_tests::turn;
use vocabulary::{ModulePhase, RunId};

const RUN: RunId = RunId(1);
const TIMES: usize = 10;
/// The plant's recording is full by then.
const RECORDED: u64 = 8300;
/// A module is at the present if it is no further behind the plant \[steps\].
const PRESENT: u64 = 100;
const SECOND_MS: f64 = 1000.0;
/// Some rounds of progress, of which one or the other may be lost \[steps\].
const ROUNDS: u64 = 200;

/// When something was first seen after a start \[ns since 1970\].
#[derive(Debug, Default)]
struct Milestones {
    start: u64,
    token: Option<u64>,
    status: Option<u64>,
    /// Samples are processed.
    sample: Option<u64>,
    /// Those that come now are processed.
    present: Option<u64>,
    in_service: Option<u64>,
}

impl Milestones {
    /// Notes a signal; `plant` is the plant's step.
    fn note(&mut self, at: u64, sign: &Sign, plant: u64) {
        match sign {
            Sign::Present(there) => set(&mut self.token, at, *there),
            Sign::Status(status) => {
                set(&mut self.status, at, true);
                set(&mut self.sample, at, status.step.is_some());
            }
            Sign::Phase(change) => {
                // Repeated for late subscribers, so its own time counts; earlier ones are another process's.
                let in_service = change.phase == ModulePhase::InService;
                let own = change.time_unix_ns > self.start;
                set(&mut self.in_service, change.time_unix_ns, in_service && own);
            }
            Sign::Progress(progress) => {
                set(&mut self.sample, at, true);
                set(&mut self.present, at, progress.step.plus(PRESENT).0 >= plant);
            }
        }
    }

    /// From the start, if everything has been seen \[ms\].
    fn complete(&self) -> Option<[f64; 5]> {
        let all = [self.token?, self.status?, self.sample?, self.present?, self.in_service?];
        Some(all.map(|at| at.saturating_sub(self.start) as f64 / 1e6))
    }
}

fn set(first: &mut Option<u64>, at: u64, seen: bool) {
    if seen {
        first.get_or_insert(at);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "measures time: wants both cores for itself"]
async fn with_the_plants_recording_it_is_in_service_within_a_second() {
    let _turn = turn::alone().await;
    let deployment = Deployment::of_watched_tower(&daemon::config::Schedule::default());
    let observer = Observer::of(&deployment).await;
    let mut signs = Signs::of(&observer, "module1").await;
    let clock = PlantClock::of(&observer).await;
    let mut diagnosers = deployment.start_diagnosers();
    observer.wait_for(&MODULES, false).await;
    let _plant = deployment.start_plant("real", 1_000_000, 3, RUN);
    clock.reach(RUN, RECORDED).await;
    let mut restarts = Vec::new();
    for _ in 0..TIMES {
        diagnosers[0].crash().await;
        let gone = |_: u64, sign: Sign| matches!(sign, Sign::Present(false)).then_some(());
        signs.find("the end of its token", gone).await;
        let mut milestones = Milestones { start: unix_ns(), ..Milestones::default() };
        diagnosers[0] = deployment.start_diagnoser(0);
        let all = loop {
            let (at, sign) = signs.next().await;
            milestones.note(at, &sign, clock.step(RUN).unwrap().0);
            if let Some(all) = milestones.complete() {
                break all;
            }
        };
        restarts.push(all);
    }
    println!("{TIMES} restarts, from the start of the process [ms]:  p50   max");
    for (place, what) in ["token", "status", "sample", "present", "in service"].iter().enumerate() {
        let ms = restarts.iter().map(|all| all[place]).collect();
        let [p50, max] = quantiles(ms, [0.5, 1.0]);
        println!("  {what:<12} {p50:7.1} {max:7.1}");
    }
    for [token, _, sample, present, in_service] in restarts {
        assert!(sample - token < SECOND_MS, "samples {} ms after the token", sample - token);
        assert!(present - token < SECOND_MS, "at the present {} ms after it", present - token);
        assert!(in_service - token < SECOND_MS, "in service {} ms after it", in_service - token);
    }
    for process in diagnosers {
        process.stop().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_recording_it_reports_initialising_until_it_has_warmed_up() {
    let _turn = turn::side_by_side().await;
    let deployment = Deployment::of_watched_tower(&daemon::config::Schedule::default());
    deployment.reconfigure(0, |table| {
        let input = table.get_mut("input").and_then(toml::Value::as_table_mut).unwrap();
        input.insert("recover_steps".into(), 0.into());
    });
    deployment.patient_with_samples();
    let warm_up = deployment.diagnoser_configs()[0].module_setup().detection.warm_up_vectors;
    let observer = Observer::of(&deployment).await;
    let clock = PlantClock::of(&observer).await;
    let mut diagnosers = deployment.start_diagnosers();
    observer.wait_for(&MODULES, false).await;
    let _plant = deployment.start_plant("real", 1_000_000, 4, RUN);
    clock.reach(RUN, RECORDED / 2).await;
    diagnosers[0].crash().await;
    observer.wait_until_gone("module1").await;
    let mut signs = Signs::of(&observer, "module1").await;
    let start = unix_ns();
    diagnosers[0] = deployment.start_diagnoser(0);
    let (mut said, mut first) = (Vec::new(), None);
    let in_service = loop {
        match signs.next().await.1 {
            Sign::Phase(change) if change.time_unix_ns < start => {}
            Sign::Phase(change) if change.phase == ModulePhase::InService => break change,
            Sign::Phase(change) => said.push(change.phase),
            Sign::Status(status) if status.phase == ModulePhase::InService => {}
            Sign::Status(status) => {
                assert_eq!(status.in_service_since_step, None);
                first = first.or(status.step);
                said.push(status.phase);
            }
            Sign::Progress(progress) => first = first.or(Some(progress.step)),
            Sign::Present(_) => {}
        }
    };
    assert!(said.contains(&ModulePhase::Initialising), "{said:?}");
    assert!(said.iter().all(|phase| *phase != ModulePhase::Stale), "{said:?}");
    // Its first sample was at most a few rounds of progress before the first step that is known of it.
    let steps = in_service.step.unwrap().since(first.unwrap());
    assert!((warm_up - ROUNDS..warm_up + ROUNDS).contains(&steps), "after {steps} steps");
    for process in diagnosers {
        process.stop().await;
    }
}
