//! What a hypothesis says in all: its likelihood over everything that it leaves open, and its size.

use vocabulary::FaultSize;

use super::level::Weighed;

/// Standard deviations of a normal that hold 95 % of it.
const WITHIN_95: f64 = 1.959_964;

/// Cases of a hypothesis: onsets, scales of its size. How likely each is beforehand is in its likelihood.
#[derive(Debug, Clone, Default)]
pub(super) struct Mixture {
    cases: Vec<Weighed>,
}

/// The same size with an error more, of this standard deviation.
fn with_error(size: FaultSize, deviation: f64) -> FaultSize {
    let half = (0.5 * (size.high - size.low)).hypot(WITHIN_95 * deviation);
    FaultSize { low: size.value - half, high: size.value + half, ..size }
}

impl Mixture {
    /// Cases of which each is as likely beforehand as the others.
    pub(super) fn of_equals(cases: Vec<Weighed>) -> Self {
        let mut mixture = Self::default();
        let share = 1.0 / cases.len() as f64;
        mixture.extend(Self { cases }, share);
        mixture
    }

    pub(super) fn add(&mut self, case: Weighed) {
        if case.log_likelihood.is_finite() {
            self.cases.push(case);
        }
    }

    /// Adds those of another, which is so likely beforehand.
    pub(super) fn extend(&mut self, other: Mixture, share: f64) {
        for case in other.cases {
            self.add(Weighed { log_likelihood: case.log_likelihood + share.ln(), ..case });
        }
    }

    /// The cases, and a size that may be wrong by so much more than noise makes it, as a standard deviation that may depend
    /// on the size.
    pub(super) fn sized(self, error: impl Fn(f64) -> f64) -> (Self, Option<FaultSize>) {
        let size = self.size().map(|size| with_error(size, error(size.value)));
        (self, size)
    }

    /// The likeliest case.
    pub(super) fn likeliest(&self) -> Option<Weighed> {
        let cases = self.cases.iter();
        cases.max_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood)).copied()
    }

    fn largest(&self) -> f64 {
        self.cases.iter().map(|case| case.log_likelihood).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Logarithm of the marginal likelihood.
    pub(super) fn log_likelihood(&self) -> f64 {
        let largest = self.largest();
        if largest == f64::NEG_INFINITY {
            return largest;
        }
        let sum: f64 = self.cases.iter().map(|case| (case.log_likelihood - largest).exp()).sum();
        largest + sum.ln()
    }

    /// The size by the mixture's mean and variance; `None` without a usable case.
    pub(super) fn size(&self) -> Option<FaultSize> {
        let largest = self.largest();
        let weights: Vec<f64> =
            self.cases.iter().map(|case| (case.log_likelihood - largest).exp()).collect();
        let all: f64 = weights.iter().sum();
        if all.is_nan() || all <= 0.0 {
            return None;
        }
        let mean_of = |of: &dyn Fn(&Weighed) -> f64| {
            self.cases.iter().zip(&weights).map(|(case, weight)| weight * of(case)).sum::<f64>()
                / all
        };
        let mean = mean_of(&|case| case.mean);
        let variance = mean_of(&|case| case.variance + (case.mean - mean).powi(2));
        let half = WITHIN_95 * variance.sqrt();
        (variance > 0.0).then_some(FaultSize {
            value: mean,
            low: mean - half,
            high: mean + half,
            own_unit: false,
        })
    }
}
