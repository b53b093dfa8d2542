//! Ten million steps in sliding mode on a smooth, ill-conditioned residual: no drift, no spikes.

use crate::definition::{Definition, error_in_tolerances};
use diagnosis::divergence::{DivergenceBank, DivergenceSettings, Interval};
use nalgebra::DMatrix;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const WINDOW: usize = 10;
const LAG: usize = 10;
const INTERVAL: usize = 2000;
const STEPS: usize = 10_000_000;
const PRIOR_SCATTER: f64 = 1e-12;
/// Samples kept for the reference: an interval, a window, a lag and a whole life of an accumulator.
const KEPT: usize = 3 * INTERVAL;

/// A lightly damped oscillator driven by noise, with a noise floor.
struct Smooth {
    random: ChaCha8Rng,
    state: [f64; 2],
}

impl Smooth {
    fn new() -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(7), state: [0.0; 2] }
    }

    fn sample(&mut self) -> f64 {
        let radius = 0.9995_f64;
        let angle = 0.05_f64;
        let drive: f64 = StandardNormal.sample(&mut self.random);
        let next =
            2.0 * radius * angle.cos() * self.state[0] - radius * radius * self.state[1] + drive;
        self.state = [next, self.state[0]];
        let floor: f64 = StandardNormal.sample(&mut self.random);
        1e-6 * next + 8e-7 * floor
    }
}

fn condition_number(samples: &[f64]) -> f64 {
    let vectors = samples.len() - WINDOW + 1;
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    let data = DMatrix::from_fn(WINDOW, vectors, |i, k| samples[k + i] - mean);
    let singular = data.singular_values();
    (singular.max() / singular.min()).powi(2)
}

#[test]
fn the_divergence_agrees_with_the_definition_after_ten_million_steps() {
    let settings = DivergenceSettings {
        window: WINDOW,
        lag: LAG,
        interval: Interval::Sliding { vectors: INTERVAL },
    };
    let definition =
        Definition { window: WINDOW, lag: LAG, interval: INTERVAL, prior_scatter: PRIOR_SCATTER };
    let mut estimator = DivergenceBank::new(settings, &[PRIOR_SCATTER]).unwrap();
    let mut series = Smooth::new();
    let mut samples = Vec::with_capacity(KEPT);
    let mut found = Vec::with_capacity(KEPT);
    for step in 0..STEPS {
        let sample = series.sample();
        let divergence = estimator.push(&[sample])[0].divergence();
        if step >= STEPS - KEPT {
            samples.push(sample);
            found.push(divergence.expect("defined, without a restart"));
        }
    }
    let condition = condition_number(&samples[KEPT - INTERVAL..]);
    println!("condition number {condition:.2e}");
    assert!((3e5..3e6).contains(&condition));
    let mut worst = 0.0_f64;
    for index in (KEPT - INTERVAL..KEPT).step_by(97) {
        let expected = definition.divergence(&samples, index).unwrap();
        worst = worst.max(error_in_tolerances(found[index], expected));
    }
    println!("worst error {worst:.2e} of the tolerance");
    assert!(worst <= 1.0);
}
