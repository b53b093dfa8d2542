//! What each process of the shipped tower takes of the machine, in real time at 1 kHz with nothing
//! happening: a diagnoser has to fit beside other work on a module's small computer. The bounds are those of
//! the programs as they are shipped: `TRUSSWATCH_PROGRAMS=$PWD/target/dist`.

use std::time::{Duration, Instant};

use daemon::config::Schedule;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::footprint::{Memory, bare_messages_percent, processor_time};
use system_tests::observer::Observer;
use system_tests::plant_clock::PlantClock;
use system_tests::process::Process;
use system_tests::recorder::Recorder;
use system_tests::turn;
use vocabulary::RunId;

const RUN: RunId = RunId(1);
/// From here on every channel is watched.
const FROM: u64 = 4_000;
/// Steps of 1 ms in a stretch during which it is measured.
const STEPS: u64 = 10_000;
/// The least of at most this many stretches counts: other load on the machine adds to some of them.
const STRETCHES: usize = 6;
/// Share of one core that a diagnoser may take \[%\]: 2.0 to 5.0 on quiet machines, by a factor of two and a half from
/// one to the next. More than the slowest is a regression,
const MOST_PERCENT: f64 = 7.0;
/// unless the machine is slower still: then so many times of what sending and receiving bare messages takes there. Seen
/// were 0.35 on one machine, not shipped but built for tests, and 0.4 to 0.7 on another, whose processors were half as
/// fast again from one minute to the next, whether they sent bare messages or diagnosed.
const TIMES_BARE_MESSAGES: f64 = 1.0;
/// Memory that a diagnoser may take \[MiB\].
const MOST_MIB: f64 = 25.0;

/// What was measured of a process during a stretch.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    percent: f64,
    memory: Memory,
    seconds: f64,
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "wants both cores for itself: run it with `--ignored`"]
async fn a_diagnoser_at_1_khz_takes_few_per_cent_of_a_core_and_25_mib() {
    let _turn = turn::alone().await;
    let bare = bare_messages_percent().await;
    let most = MOST_PERCENT.max(TIMES_BARE_MESSAGES * bare);
    println!("bare messages: {bare:.2} % of a core; a diagnoser may take {most:.2} %");
    let deployment = Deployment::of_tower(&Schedule::default());
    deployment.publish_as_shipped();
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&MODULES, false).await;
    let clock = PlantClock::of(&observer).await;
    let plant = deployment.start_plant("real", 100 * STEPS, 7, RUN);
    clock.reach(RUN, FROM).await;
    let mut least = [f64::INFINITY; MODULES.len()];
    for _ in 0..STRETCHES {
        let processes =
            [(MODULES[0], &diagnosers[0]), (MODULES[1], &diagnosers[1]), ("plant", &plant)];
        let stretches = stretch(&clock, &processes).await;
        // The plant is measured too, but nothing is asked of it.
        for (least, stretch) in least.iter_mut().zip(stretches) {
            *least = least.min(stretch.percent);
            assert!(stretch.memory.proportional_mib < MOST_MIB, "{stretch:?}");
        }
        if least.iter().all(|percent| *percent < most) {
            break;
        }
    }
    assert!(least.iter().all(|percent| *percent < most), "{least:.2?}");
    for process in diagnosers.into_iter().chain([plant]) {
        process.stop().await;
    }
}

/// As a diagnoser, for both modules together.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "wants both cores for itself: run it with `--ignored`"]
async fn a_recorder_of_two_modules_at_1_khz_takes_few_per_cent_of_a_core() {
    let _turn = turn::alone().await;
    let most = MOST_PERCENT.max(TIMES_BARE_MESSAGES * bare_messages_percent().await);
    let deployment = Deployment::of_tower(&Schedule::default());
    deployment.publish_as_shipped();
    let diagnosers = deployment.start_diagnosers();
    let mut recorder = Recorder::start(&deployment);
    recorder.hears(&MODULES).await;
    let observer = Observer::of(&deployment).await;
    let clock = PlantClock::of(&observer).await;
    let plant = deployment.start_plant("real", 100 * STEPS, 7, RUN);
    clock.reach(RUN, FROM).await;
    let mut least = f64::INFINITY;
    for _ in 0..STRETCHES {
        let bytes = recorder.bytes();
        let stretches = stretch(&clock, &[("recorder", recorder.process())]).await;
        let mb_per_hour = (recorder.bytes() - bytes) as f64 * 3600.0 / stretches[0].seconds / 1e6;
        println!("{mb_per_hour:.0} MB an hour");
        least = least.min(stretches[0].percent);
        if least < most {
            break;
        }
    }
    assert!(least < most, "{least:.2} %, at most {most:.2} %");
    plant.stop().await;
    for process in diagnosers {
        process.stop().await;
    }
    recorder.end().await;
}

/// Measures, and returns what each process took.
async fn stretch(clock: &PlantClock, processes: &[(&str, &Process)]) -> Vec<Stretch> {
    let processes = || processes.iter().copied();
    let before: Vec<_> = processes().map(|(_, process)| processor_time(process.pid())).collect();
    let (start, from) = (Instant::now(), clock.step(RUN).unwrap());
    clock.reach(RUN, from.0 + STEPS).await;
    let (elapsed, steps) = (start.elapsed(), clock.step(RUN).unwrap().since(from));
    println!("{steps} steps in {elapsed:.2?}");
    let measure = |((name, process), before): ((&str, &Process), &Duration)| {
        let spent = (processor_time(process.pid()) - *before).as_secs_f64();
        let percent = 100.0 * spent / elapsed.as_secs_f64();
        let per_step_us = 1e6 * spent / steps as f64;
        let memory = Memory::of(process.pid());
        let Memory { proportional_mib, private_mib } = memory;
        println!(
            "{name}: {percent:.2} % of a core, {per_step_us:.1} µs per step; \
             {proportional_mib:.1} MiB PSS, {private_mib:.1} MiB private"
        );
        Stretch { percent, memory, seconds: elapsed.as_secs_f64() }
    };
    processes().zip(&before).map(measure).collect()
}
