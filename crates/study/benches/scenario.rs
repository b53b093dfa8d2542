//! How fast campaigns run: scenarios of 15 s of the tower with its plant and both diagnosers.

#![allow(clippy::print_stdout, reason = "benches print results")]

use std::convert::Infallible;
use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use study::{Campaign, ScenarioRanges, parallel};

#[path = "../tests/tower/mod.rs"]
mod tower;

fn campaign() -> Campaign {
    let (structure, parameters, setups) = tower::parts();
    Campaign {
        structure,
        parameters,
        setups,
        mismatch: 0.1,
        controllers: Vec::new(),
        seed: 1,
        ranges: ScenarioRanges::default(),
    }
}

#[expect(clippy::expect_used, reason = "a bench without a scenario has nothing to measure")]
fn run(campaign: &Campaign, number: u64) {
    black_box(campaign.run_scenario(number).expect("the tower has scenarios"));
}

fn scenario(criterion: &mut Criterion) {
    let campaign = campaign();
    let mut group = criterion.benchmark_group("scenario");
    group.sample_size(20);
    let mut number = 0;
    group.bench_function("15 s", |bencher| {
        bencher.iter(|| {
            number += 1;
            run(&campaign, number);
        });
    });
    group.finish();
    print_speeds(&campaign);
}

/// How many times faster than the tower itself, with one run at a time and with more, measured in
/// turns so that all see the same machine.
fn print_speeds(campaign: &Campaign) {
    const TURNS: usize = 5;
    const RUNS_A_JOB: usize = 6;
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let mut jobs: Vec<usize> = std::iter::successors(Some(1), |jobs| Some(2 * jobs))
        .take_while(|jobs| *jobs < processors)
        .collect();
    jobs.push(processors);
    let mut speeds = vec![Vec::new(); jobs.len()];
    for _ in 0..TURNS {
        for (&jobs, speeds) in jobs.iter().zip(&mut speeds) {
            let runs: Vec<u64> = (0..).take(RUNS_A_JOB * jobs).collect();
            speeds.push(
                campaign.ranges.length_s * runs.len() as f64 / seconds(campaign, &runs, jobs),
            );
        }
    }
    let median = |speeds: &mut Vec<f64>| {
        speeds.sort_by(f64::total_cmp);
        speeds[speeds.len() / 2]
    };
    let medians: Vec<f64> = speeds.iter_mut().map(median).collect();
    println!("  jobs   times real time   times real time a job   scaling");
    for (jobs, speed) in jobs.iter().zip(&medians) {
        let (a_job, scaling) = (speed / *jobs as f64, speed / medians[0]);
        println!("  {jobs:4}   {speed:15.0}   {a_job:21.0}   {scaling:7.2}");
    }
}

fn seconds(campaign: &Campaign, runs: &[u64], jobs: usize) -> f64 {
    let start = Instant::now();
    let work = |number: &u64| {
        run(campaign, *number);
        Ok::<_, Infallible>(())
    };
    let Ok(()) = parallel::for_each(runs, jobs, &AtomicBool::new(false), work, |_, ()| Ok(()));
    start.elapsed().as_secs_f64()
}

criterion_group!(benches, scenario);
criterion_main!(benches);
