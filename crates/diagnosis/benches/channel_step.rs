//! One channel-step of the divergence, beside recomputing inverse and determinant from scratch.
//!
//! `cargo bench -p diagnosis --bench channel_step`

#![allow(clippy::expect_used, clippy::print_stdout, reason = "a benchmark may stop")]

use std::collections::VecDeque;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use diagnosis::divergence::{DivergenceBank, DivergenceSettings, Interval};
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const INTERVAL: usize = 2000;
const PRIOR_SCATTER: f64 = 1e-2;

fn samples(count: usize) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    StandardNormal.sample_iter(&mut random).take(count).collect()
}

/// The textbook way: running scatter, inverse and determinant recomputed at every step.
struct Recompute {
    window: usize,
    mean: DVector<f64>,
    scatter: DMatrix<f64>,
    count: f64,
    earlier: VecDeque<(DVector<f64>, DMatrix<f64>)>,
}

impl Recompute {
    fn new(window: usize) -> Self {
        Self {
            window,
            mean: DVector::zeros(window),
            scatter: DMatrix::identity(window, window) * PRIOR_SCATTER,
            count: 0.0,
            earlier: VecDeque::new(),
        }
    }

    fn add(&mut self, vector: &DVector<f64>) {
        let u = vector - &self.mean;
        let weight = self.count / (self.count + 1.0);
        self.mean.axpy(1.0 / (self.count + 1.0), &u, 1.0);
        self.count += 1.0;
        self.scatter.ger(weight, &u, &u, 1.0);
    }

    fn delete(&mut self, vector: &DVector<f64>) {
        let u = vector - &self.mean;
        let weight = -self.count / (self.count - 1.0);
        self.mean.axpy(-1.0 / (self.count - 1.0), &u, 1.0);
        self.count -= 1.0;
        self.scatter.ger(weight, &u, &u, 1.0);
    }

    fn divergence(&mut self) -> Option<f64> {
        let covariance = &self.scatter / (self.count - 1.0);
        self.earlier.push_back((self.mean.clone(), covariance.clone()));
        if self.earlier.len() <= self.window {
            return None;
        }
        let (earlier_mean, earlier_covariance) = self.earlier.pop_front()?;
        let log_ratio = (covariance.determinant() / earlier_covariance.determinant()).ln();
        let inverse = covariance.try_inverse()?;
        let shift = &self.mean - &earlier_mean;
        let trace = inverse.dot(&earlier_covariance);
        Some(0.5 * (trace + shift.dot(&(&inverse * &shift)) - self.window as f64 + log_ratio))
    }
}

/// Channels of a module of the shipped tower; they are carried side by side.
const CHANNELS: usize = 12;

/// A bank whose interval has been full for a while, with its stream of samples.
fn running_bank(window: usize, data: &[f64]) -> impl FnMut() {
    let settings = DivergenceSettings {
        window,
        lag: window,
        interval: Interval::Sliding { vectors: INTERVAL },
    };
    let mut bank =
        DivergenceBank::new(settings, &[PRIOR_SCATTER; CHANNELS]).expect("settings in range");
    let mut next = 0;
    let mut step = move || {
        next = if next + 1 < data.len() { next + 1 } else { 0 };
        black_box(bank.push(&[data[next]; CHANNELS]));
    };
    (0..3 * INTERVAL).for_each(|_| step());
    step
}

/// The textbook way in the same state.
fn running_recompute(window: usize, data: &[f64]) -> impl FnMut() {
    let vector = move |end: usize| DVector::from_column_slice(&data[end - window..end]);
    let mut recompute = Recompute::new(window);
    let mut end = window + INTERVAL;
    (window..end).for_each(|end| recompute.add(&vector(end)));
    move || {
        recompute.add(&vector(end));
        recompute.delete(&vector(end - INTERVAL));
        end = if end + 1 < data.len() { end + 1 } else { INTERVAL + window };
        black_box(recompute.divergence());
    }
}

fn channel_step(c: &mut Criterion) {
    let data = samples(1 << 16);
    let mut group = c.benchmark_group("channel_step");
    for window in [10, 20, 32] {
        group.throughput(Throughput::Elements(CHANNELS as u64));
        group.bench_function(BenchmarkId::new("estimator", window), |b| {
            b.iter(running_bank(window, &data));
        });
        group.throughput(Throughput::Elements(1));
        group.bench_function(BenchmarkId::new("recompute", window), |b| {
            b.iter(running_recompute(window, &data));
        });
    }
    group.finish();
    print_ratios(&data);
}

/// How many times faster, measured in turns so that both see the same machine.
fn print_ratios(data: &[f64]) {
    const TURNS: usize = 41;
    const STEPS: u32 = 500;
    println!("  w = l   channel-step   recomputed   times faster");
    for window in [10, 20, 32] {
        let mut bank = running_bank(window, data);
        let mut recompute = running_recompute(window, data);
        let mut turns: Vec<[f64; 2]> = Vec::new();
        for _ in 0..TURNS {
            let of_bank = seconds(|| (0..STEPS).for_each(|_| bank()));
            let of_recompute = seconds(|| (0..STEPS).for_each(|_| recompute()));
            let steps = f64::from(STEPS);
            turns.push([of_bank / steps / CHANNELS as f64, of_recompute / steps]);
        }
        turns.sort_by(|a, b| (a[1] / a[0]).total_cmp(&(b[1] / b[0])));
        let [fast, slow] = turns[TURNS / 2].map(|s| s * 1e9);
        println!("  {window:5}   {fast:9.0} ns   {slow:7.0} ns   {:12.1}", slow / fast);
    }
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = std::time::Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

criterion_group!(benches, channel_step);
criterion_main!(benches);
