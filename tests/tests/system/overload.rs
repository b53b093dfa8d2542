//! A real-time plant that is too fast for its diagnosers: they log it, drop the samples that they cannot
//! diagnose, keep their lag and memory within bounds, raise no alarm for missed samples, and are in
//! service again soon when it is over.

use std::time::{Duration, Instant};

use daemon::config::Schedule;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::footprint::allocated_kib;
use system_tests::observer::Observer;
use system_tests::throttle::Throttle;
use system_tests::turn;
use system_tests::worst::WorstStatus;
use vocabulary::{ModuleStatus, RunId};

/// As a factor on real time.
const TOO_FAST: &str = "100";
/// A diagnoser's part of its processor is one in this many.
const SHARE: u32 = 4;
/// Longer than the test.
const STEPS: u64 = 1_000_000_000;
/// How often the backlog is to be dropped before it is over.
const TIMES: u64 = 10;
/// No sample that is diagnosed is older \[ms\].
const OLDEST_MS: f64 = 2000.0;
/// The limits of the queues, in samples and messages, are worth less.
const MOST_KIB: u64 = 200_000;
/// From the first step of a plant in real time, 2.5 s of which are the start of any run.
const SOON: Duration = Duration::from_secs(10);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "wants both cores for itself: run it with `--ignored`"]
async fn an_overloaded_diagnoser_logs_it_drops_its_backlog_and_recovers() {
    let _turn = turn::alone().await;
    let deployment = Deployment::of_tower(&Schedule::default());
    for place in 1..=MODULES.len() {
        // High load for each step.
        deployment.set(place, "publish", "divergence_every_steps", 1);
    }
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    // The plant has the other processor for itself. Half of one each would be enough for the diagnosers.
    diagnosers.iter().for_each(|process| process.pin(0));
    let throttles = diagnosers.iter().map(|process| Throttle::to_one_part_in(SHARE, process));
    let throttles = throttles.collect::<Vec<_>>();
    let worst = WorstStatus::of(&observer).await;
    let plant = deployment.start_plant(TOO_FAST, STEPS, 3, RunId(1));
    for (module, process) in MODULES.into_iter().zip(&diagnosers) {
        let overcome = |status: &ModuleStatus| status.intake.resynchronised >= TIMES;
        let status = observer.status_of(module, overcome).await;
        let (worst, kib) = (worst.of_module(module), allocated_kib(process.pid()).unwrap());
        let (step, intake) = (status.step, status.intake);
        println!("{module}: step {step:?}, {kib} KiB, {worst:?}");
        println!("  {intake:?}\n  {:?}", status.diagnosis);
        // While the process has no processor, samples grow older: its longest silence is that long on a slow machine.
        let oldest_ms = OLDEST_MS + 1e3 * worst.silence.as_secs_f64();
        assert!(worst.sample_age_ms < oldest_ms, "{module}: {worst:?}");
        assert!(worst.silence < Duration::from_secs(2), "{module}: {worst:?}");
        assert!(kib < MOST_KIB, "{module}: {kib} KiB");
        assert!(process.log().contains("backlog of samples dropped"), "{}", process.log());
        assert_eq!((status.latched, status.unconfirmed), (0, 0), "{module} is healthy");
    }
    drop(throttles);
    plant.stop().await;
    let start = Instant::now();
    let plant = deployment.start_plant("real", STEPS, 3, RunId(2));
    for module in MODULES {
        let back = |status: &ModuleStatus| {
            status.run == Some(RunId(2)) && status.in_service_since_step.is_some()
        };
        let status = observer.status_of(module, back).await;
        println!("{module}: in service again after {:?}, {status:?}", start.elapsed());
        assert!(start.elapsed() < SOON, "{module} after {:?}", start.elapsed());
        assert_eq!((status.latched, status.unconfirmed), (0, 0), "{module} is healthy");
    }
    plant.stop().await;
    for process in diagnosers {
        process.stop().await;
    }
}
