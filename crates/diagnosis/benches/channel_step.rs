//! One channel-step of the divergence, beside recomputing inverse and determinant from scratch.
//!
//! `cargo bench -p diagnosis --bench channel_step`

#![allow(clippy::expect_used, reason = "a benchmark may stop")]

use std::collections::VecDeque;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
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

/// The textbook way: running scatter, inverse and determinant anew at every step.
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

fn channel_step(c: &mut Criterion) {
    let data = samples(1 << 16);
    let vector = |window: usize, end: usize| DVector::from_column_slice(&data[end - window..end]);
    let mut group = c.benchmark_group("channel_step");
    for window in [10, 20, 32] {
        group.bench_function(BenchmarkId::new("estimator", window), |b| {
            let settings = DivergenceSettings {
                window,
                lag: window,
                interval: Interval::Sliding { vectors: INTERVAL },
            };
            let mut estimator =
                DivergenceBank::new(settings, &[PRIOR_SCATTER; 12]).expect("settings in range");
            let mut stream = data.iter().cycle();
            for sample in stream.by_ref().take(3 * INTERVAL) {
                estimator.push(&[*sample; 12]);
            }
            b.iter(|| stream.next().map(|x| black_box(estimator.push(&[*x; 12])[0])));
        });
        group.bench_function(BenchmarkId::new("recompute", window), |b| {
            let mut recompute = Recompute::new(window);
            let mut end = window;
            for _ in 0..INTERVAL {
                recompute.add(&vector(window, end));
                end += 1;
            }
            b.iter(|| {
                recompute.add(&vector(window, end));
                recompute.delete(&vector(window, end - INTERVAL));
                end = if end + 1 < data.len() { end + 1 } else { INTERVAL + window };
                black_box(recompute.divergence())
            });
        });
    }
    group.finish();
}

criterion_group!(benches, channel_step);
criterion_main!(benches);
