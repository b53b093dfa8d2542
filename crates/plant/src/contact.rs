//! A bad contact, which opens and closes at random.
//!
//! It alternates between closed and open, each for an exponentially distributed time. It also switches between samples;
//! a sample reads it in its state at that time.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1};

/// The contact in the wiring of one gage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contact {
    /// Mean times closed and open, in steps.
    closed_steps: f64,
    open_steps: f64,
    open: bool,
    /// Remaining time in the present state from the next sample on, in steps; if not positive, it switches before.
    left_steps: f64,
}

impl Contact {
    /// A contact that opens at the next sample; mean times closed and open \[s\].
    pub(crate) fn new(closed_s: f64, open_s: f64, step_s: f64) -> Self {
        Self {
            closed_steps: closed_s / step_s,
            open_steps: open_s / step_s,
            open: false,
            left_steps: 0.0,
        }
    }

    /// Whether it is open in this sample. Advances to the next sample.
    pub(crate) fn is_open(&mut self, generator: &mut ChaCha8Rng) -> bool {
        while self.left_steps <= 0.0 {
            self.open = !self.open;
            let mean = if self.open { self.open_steps } else { self.closed_steps };
            let time: f64 = Exp1.sample(generator);
            self.left_steps += mean * time;
        }
        self.left_steps -= 1.0;
        self.open
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::Stream;

    fn samples(closed_s: f64, open_s: f64, step_s: f64, seed: u64) -> Vec<bool> {
        let mut generator = Stream::GageWalk(0).generator(seed);
        let mut contact = Contact::new(closed_s, open_s, step_s);
        (0..COUNT).map(|_| contact.is_open(&mut generator)).collect()
    }

    const COUNT: usize = 400_000;

    /// Exponential times make it a Markov chain: with p the share of open time and 1/τ = 1/closed + 1/open it is open a
    /// time t after it was open with probability p + (1 − p) exp(−t/τ). The share over a time T deviates by
    /// √(2 p (1 − p) τ/T), or as independent samples do if τ is below a step.
    #[test]
    fn it_is_the_markov_chain_of_its_mean_times() {
        for (closed_s, open_s, step_s) in [
            (0.05, 0.01, 1e-3),
            (0.01, 0.05, 1e-3),
            (0.02, 0.02, 5e-3),
            (1e-3, 1e-3, 1e-3),
            (1e-3, 3e-3, 0.1),
        ] {
            let open = samples(closed_s, open_s, step_s, 7);
            assert!(open[0]);
            let (p, tau) = (open_s / (closed_s + open_s), closed_s * open_s / (closed_s + open_s));
            let memory = 2.0_f64.mul_add(tau / step_s, 1.0);
            let share = |wanted: usize, of: f64| wanted as f64 / of;
            let opened = open.iter().filter(|open| **open).count();
            let deviation = (p * (1.0 - p) * memory / COUNT as f64).sqrt();
            let found = share(opened, COUNT as f64);
            assert!((found - p).abs() < 4.0 * deviation, "{closed_s} {open_s}: {found} for {p}");
            for steps in [1, 2, 5, 20] {
                let both = open.windows(steps + 1).filter(|w| w[0] && w[steps]).count();
                let expected = p + (1.0 - p) * (-(steps as f64) * step_s / tau).exp();
                let deviation = (0.25 * memory / opened as f64).sqrt();
                let found = share(both, opened as f64);
                assert!(
                    (found - expected).abs() < 4.0 * deviation,
                    "{steps}: {found} for {expected}"
                );
            }
        }
    }

    #[test]
    fn the_same_stream_opens_it_at_the_same_samples() {
        assert_eq!(samples(0.05, 0.01, 1e-3, 7), samples(0.05, 0.01, 1e-3, 7));
        assert_ne!(samples(0.05, 0.01, 1e-3, 7), samples(0.05, 0.01, 1e-3, 8));
    }
}
