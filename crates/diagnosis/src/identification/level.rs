//! A level that wanders, seen through white noise, with regressors: the likelihood of a series, and what it says of the
//! regressors' coefficients.
//!
//! y_k = ℓ_k + x_kᵀ θ + ε_k, ℓ_k = ℓ_{k−1} + η_k, with normal ε, η and ℓ_0 of known variances (Harvey, *Forecasting,
//! structural time series models and the Kalman filter*, 1989, 3.4). The filter is linear, so the regressors go through
//! the same one as the series; what is left of both is white, and θ follows from it by least squares. With a normal
//! prior of θ the marginal likelihood has a closed form.

use std::f64::consts::TAU;

use nalgebra::{Const, SMatrix, SVector};

/// How much a healthy level wanders in a second, in standard deviations of a step's noise; each as likely as the others.
const WALKS: [f64; 7] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];
/// Values count whose log-likelihood before the onset is within this of the largest one.
const WALKS_WITHIN: f64 = 3.0;

/// Where too little is known.
const USUAL_WALK: f64 = 0.1;
/// Values before the onset without which nothing is learnt from them.
pub(super) const LEAST_BEFORE: usize = 40;

/// How likely it is that it wanders more later than it did before.
const MORE_LATER: f64 = 0.05;

/// Twice the negative logarithm of a normal density at so much off its mean.
pub(super) fn deviance(off: f64, variance: f64) -> f64 {
    off * off / variance + (TAU * variance).ln()
}

/// The filter, after some values.
#[derive(Debug, Clone)]
pub(super) struct LevelFilter<const P: usize> {
    level: f64,
    variance: f64,
    columns: SVector<f64, P>,
    /// Σ ν_x ν_xᵀ/S and Σ ν_x ν_y/S of the innovations ν and their variances S.
    information: SMatrix<f64, P, P>,
    pull: SVector<f64, P>,
    /// Σ ν_y²/S + ln 2πS.
    deviance: f64,
}

/// By how much a level may have moved until the end of the stretch that a value is the mean of: variances of the level at
/// its end and of the mean, and their covariance, given the level before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Walked {
    end: f64,
    mean: f64,
    both: f64,
}

impl Walked {
    /// All at once, before the stretch.
    pub(super) fn before(variance: f64) -> Self {
        Self { end: variance, mean: variance, both: variance }
    }

    /// In so many equal and independent steps, one before each value that the mean is of.
    pub(super) fn during(variance: f64, steps: f64) -> Self {
        let n = steps.max(1.0);
        Self {
            end: variance,
            mean: variance * (n + 1.0) * (2.0 * n + 1.0) / (6.0 * n * n),
            both: variance * (n + 1.0) / (2.0 * n),
        }
    }
}

/// What is believed of a coefficient before anything was seen: normal.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Prior {
    pub(crate) mean: f64,
    pub(crate) deviation: f64,
}

impl Prior {
    /// About zero.
    pub(crate) fn about_zero(deviation: f64) -> Self {
        Self { mean: 0.0, deviation }
    }
}

/// What a series says under a hypothesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weighed {
    /// Logarithm of the marginal likelihood.
    pub(super) log_likelihood: f64,
    /// Mean and variance of the first coefficient; zero without any.
    pub(super) mean: f64,
    pub(super) variance: f64,
    /// Which place along an axis it is of.
    pub(super) place: usize,
    /// Where it has ended, as a place among points with parts of the way to the next; infinite if it lasts.
    pub(super) end: f64,
}

impl Weighed {
    /// Without a coefficient, of a fault that lasts.
    pub(super) fn of(log_likelihood: f64) -> Self {
        Self { log_likelihood, mean: 0.0, variance: 0.0, place: 0, end: f64::INFINITY }
    }
}

impl<const P: usize> LevelFilter<P> {
    /// Before the first value.
    pub(super) fn new(level: Prior) -> Self {
        Self {
            level: level.mean,
            variance: level.deviation * level.deviation,
            columns: SVector::zeros(),
            information: SMatrix::zeros(),
            pull: SVector::zeros(),
            deviance: 0.0,
        }
    }

    /// Takes a value, `walked` being how the level may have moved since the one before.
    pub(super) fn take(
        &mut self,
        value: f64,
        walked: Walked,
        noise_variance: f64,
        regressors: [f64; P],
    ) {
        let shared = self.variance + walked.both;
        let spread = self.variance + walked.mean + noise_variance;
        let gain = shared / spread;
        let innovation = value - self.level;
        let off = SVector::from(regressors) - self.columns;
        self.information.ger(1.0 / spread, &off, &off, 1.0);
        self.pull.axpy(innovation / spread, &off, 1.0);
        self.deviance += deviance(innovation, spread);
        self.level += gain * innovation;
        self.columns.axpy(gain, &off, 1.0);
        self.variance += walked.end - gain * shared;
    }

    /// The same with one regressor that has been zero so far in place of none.
    pub(super) fn widened<const Q: usize>(&self) -> LevelFilter<Q> {
        let mut wider =
            LevelFilter::new(Prior { mean: self.level, deviation: self.variance.sqrt() });
        wider.deviance = self.deviance;
        wider
    }

    /// Two series with the same coefficients.
    pub(super) fn together(&self, other: &Self) -> Self {
        Self {
            information: self.information + other.information,
            pull: self.pull + other.pull,
            deviance: self.deviance + other.deviance,
            ..self.clone()
        }
    }

    /// Mean and variance of the level if all coefficients are zero.
    pub(super) fn level(&self) -> (f64, f64) {
        (self.level, self.variance)
    }

    /// Logarithm of the likelihood if all coefficients are zero.
    pub(super) fn log_likelihood(&self) -> f64 {
        -0.5 * self.deviance
    }

    /// Weighs it with a prior of each coefficient.
    pub(super) fn weigh(&self, priors: &[Prior; P]) -> Option<Weighed>
    where
        Const<P>: nalgebra::DimMin<Const<P>, Output = Const<P>>,
    {
        let mut information = self.information;
        let mut pull = self.pull;
        let mut log = -0.5 * self.deviance;
        for (place, prior) in priors.iter().enumerate() {
            let precision = 1.0 / (prior.deviation * prior.deviation);
            information[(place, place)] += precision;
            pull[place] += precision * prior.mean;
            log += 0.5 * precision.ln() - 0.5 * precision * prior.mean * prior.mean;
        }
        let factor = information.cholesky()?;
        let mean = factor.solve(&pull);
        log += 0.5 * pull.dot(&mean) - factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let covariance = factor.inverse();
        Some(Weighed {
            log_likelihood: log,
            mean: mean.get(0).copied().unwrap_or(0.0),
            variance: covariance.get((0, 0)).copied().unwrap_or(0.0),
            place: 0,
            end: f64::INFINITY,
        })
    }
}

/// How much a level may wander, and how likely each is in comparison with the others, given the logarithm of the likelihood before
/// the onset. The wind is not the same before and after it: so the next larger one is among them.
pub(super) fn likely_walks(log_likelihood: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let weighed = WALKS.map(|walk| (walk, log_likelihood(walk)));
    let largest = weighed.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    let mut likely: Vec<(f64, f64)> = weighed
        .into_iter()
        .filter(|(_, log)| *log >= largest - WALKS_WITHIN)
        .map(|(walk, _)| (walk, 1.0))
        .collect();
    let most = likely.last().map_or(0.0, |(walk, _)| *walk);
    let more = WALKS.into_iter().find(|walk| *walk > most);
    likely.extend(more.map(|walk| (walk, MORE_LATER)));
    likely
}

/// How much a level most likely wanders, given so many values before the onset and the logarithm of their likelihood.
pub(super) fn likeliest_walk(before: usize, log_likelihood: impl Fn(f64) -> f64) -> f64 {
    if before < LEAST_BEFORE {
        return USUAL_WALK;
    }
    let weighed = WALKS.map(|walk| (walk, log_likelihood(walk)));
    weighed.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(USUAL_WALK, |(walk, _)| walk)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    const VALUES: [f64; 6] = [0.3, -0.2, 1.4, 1.1, 1.9, 1.2];
    const WALKED: f64 = 0.04;
    const NOISE: f64 = 0.25;
    const STEP: [f64; 6] = [0.0, 0.0, 1.0, 1.0, 1.0, 1.0];

    fn start() -> Prior {
        Prior { mean: 0.1, deviation: 0.7 }
    }

    /// The joint normal of all values, written out: covariance of level, noise and coefficient.
    fn dense(prior: Prior) -> f64 {
        let covariance = DMatrix::from_fn(6, 6, |a, b| {
            let level = start().deviation.powi(2) + WALKED * (a.min(b) + 1) as f64;
            let noise = if a == b { NOISE } else { 0.0 };
            level + noise + prior.deviation.powi(2) * STEP[a] * STEP[b]
        });
        let mean = DVector::from_fn(6, |k, _| start().mean + prior.mean * STEP[k]);
        let off = DVector::from_row_slice(&VALUES) - mean;
        let distance = off.dot(&covariance.clone().cholesky().unwrap().solve(&off));
        -0.5 * (distance + covariance.determinant().ln() + 6.0 * TAU.ln())
    }

    fn filtered() -> LevelFilter<1> {
        let mut level = LevelFilter::<1>::new(start());
        for (value, step) in VALUES.into_iter().zip(STEP) {
            level.take(value, Walked::before(WALKED), NOISE, [step]);
        }
        level
    }

    #[test]
    fn the_marginal_likelihood_is_that_of_the_joint_normal() {
        for prior in [Prior::about_zero(2.0), Prior { mean: 1.0, deviation: 0.05 }] {
            let weighed = filtered().weigh(&[prior]).unwrap();
            let expected = dense(prior);
            assert!((weighed.log_likelihood - expected).abs() < 1e-12, "{expected}");
        }
        let none = filtered().log_likelihood();
        assert!((none - dense(Prior::about_zero(1e-9))).abs() < 1e-9, "{none}");
    }

    /// Means of three values each, of a level that moves before every value, against the joint normal of the means.
    #[test]
    fn means_of_a_level_that_moves_meanwhile_have_the_likelihood_of_the_joint_normal() {
        let means = [0.4, 1.1];
        let mut level = LevelFilter::<0>::new(start());
        means
            .iter()
            .for_each(|mean| level.take(*mean, Walked::during(3.0 * WALKED, 3.0), NOISE, []));
        let share = |mean: usize, step: usize| (0..3).filter(|k| 3 * mean + k >= step).count();
        let covariance = DMatrix::from_fn(2, 2, |a, b| {
            let moved: f64 =
                (0..6).map(|step| (share(a, step) * share(b, step)) as f64 / 9.0).sum();
            start().deviation.powi(2) + WALKED * moved + if a == b { NOISE } else { 0.0 }
        });
        let off = DVector::from_row_slice(&means).add_scalar(-start().mean);
        let distance = off.dot(&covariance.clone().cholesky().unwrap().solve(&off));
        let expected = -0.5 * (distance + covariance.determinant().ln() + 2.0 * TAU.ln());
        assert!((level.log_likelihood() - expected).abs() < 1e-12, "{expected}");
    }

    #[test]
    fn a_filter_is_widened_by_a_regressor_that_has_been_zero_so_far() {
        let mut narrow = LevelFilter::<0>::new(start());
        VALUES[..2].iter().for_each(|value| narrow.take(*value, Walked::before(WALKED), NOISE, []));
        let mut wide: LevelFilter<1> = narrow.widened();
        VALUES[2..]
            .iter()
            .for_each(|value| wide.take(*value, Walked::before(WALKED), NOISE, [1.0]));
        let prior = [Prior::about_zero(2.0)];
        let (one, other) = (wide.weigh(&prior).unwrap(), filtered().weigh(&prior).unwrap());
        assert!((one.log_likelihood - other.log_likelihood).abs() < 1e-12);
        assert!((one.mean - other.mean).abs() < 1e-12);
        assert!((one.variance - other.variance).abs() < 1e-12);
    }
}
