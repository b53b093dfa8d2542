//! How fast campaigns run: scenarios of 15 s of the tower with its plant and both diagnosers.

#![allow(clippy::print_stdout, reason = "benches print results")]

use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use study::scenarios::{ScenarioCampaign, ScenarioRanges};

#[path = "../tests/tower/mod.rs"]
mod tower;

fn campaign() -> ScenarioCampaign {
    tower::scenarios(tower::system(0.1, 1), ScenarioRanges::default())
}

fn run(campaign: &ScenarioCampaign, number: u64) {
    black_box(tower::row(campaign, number));
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
fn print_speeds(campaign: &ScenarioCampaign) {
    const TURNS: usize = 5;
    const RUNS_A_JOB: u64 = 6;
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let mut jobs: Vec<usize> = std::iter::successors(Some(1), |jobs| Some(2 * jobs))
        .take_while(|jobs| *jobs < processors)
        .collect();
    jobs.push(processors);
    let mut speeds = vec![Vec::new(); jobs.len()];
    for _ in 0..TURNS {
        for (&jobs, speeds) in jobs.iter().zip(&mut speeds) {
            let runs = RUNS_A_JOB * jobs as u64;
            let start = Instant::now();
            black_box(tower::rows(campaign, 0..runs, jobs));
            let seconds = start.elapsed().as_secs_f64();
            speeds.push(campaign.ranges.length_s * runs as f64 / seconds);
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

criterion_group!(benches, scenario);
criterion_main!(benches);
