//! Detectors that watch each channel by itself. Their input is standardised: healthy residuals have mean 0 and standard
//! deviation 1.

use std::collections::VecDeque;

/// A detector of one channel.
pub(super) trait ChannelDetector {
    /// The statistic after the next residual; the larger, the less healthy.
    fn step(&mut self, residual: f64) -> f64;
}

/// The size of the residual itself (Shewhart 1931).
pub(super) struct Shewhart;

impl ChannelDetector for Shewhart {
    fn step(&mut self, residual: f64) -> f64 {
        residual.abs()
    }
}

/// Cumulative sums in both directions (Page 1954).
#[derive(Default)]
pub(super) struct Cusum {
    up: f64,
    down: f64,
}

impl Cusum {
    /// Half the shift that it is tuned for: one standard deviation.
    const ALLOWANCE: f64 = 0.5;
}

impl ChannelDetector for Cusum {
    fn step(&mut self, residual: f64) -> f64 {
        self.up = (self.up + residual - Self::ALLOWANCE).max(0.0);
        self.down = (self.down - residual - Self::ALLOWANCE).max(0.0);
        self.up.max(self.down)
    }
}

/// The exponentially weighted moving average, in units of its standard deviation in the steady state (Roberts 1959).
#[derive(Default)]
pub(super) struct Ewma(f64);

impl Ewma {
    /// Weight of the latest residual.
    pub(super) const WEIGHT: f64 = 0.2;
}

impl ChannelDetector for Ewma {
    fn step(&mut self, residual: f64) -> f64 {
        self.0 += Self::WEIGHT * (residual - self.0);
        self.0.abs() / (Self::WEIGHT / (2.0 - Self::WEIGHT)).sqrt()
    }
}

/// The sum of the squares of the latest residuals: χ² with as many degrees of freedom if they are independent.
#[derive(Default)]
pub(super) struct ChiSquared(VecDeque<f64>);

impl ChiSquared {
    /// The window of the shipped divergence.
    const WINDOW: usize = 12;
}

impl ChannelDetector for ChiSquared {
    fn step(&mut self, residual: f64) -> f64 {
        self.0.push_back(residual * residual);
        if self.0.len() > Self::WINDOW {
            self.0.pop_front();
        }
        self.0.iter().sum()
    }
}

/// The generalized likelihood ratio of a jump of unknown size at an unknown time: the largest S²/2k over the sums S of the
/// latest k residuals (Willsky and Jones 1976).
#[derive(Default)]
pub(super) struct Glr(VecDeque<f64>);

impl Glr {
    /// The longest sum.
    const WINDOW: usize = 64;
}

impl ChannelDetector for Glr {
    fn step(&mut self, residual: f64) -> f64 {
        self.0.push_front(residual);
        self.0.truncate(Self::WINDOW);
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for (count, value) in (1_u32..).zip(&self.0) {
            sum += value;
            largest = largest.max(sum * sum / (2.0 * f64::from(count)));
        }
        largest
    }
}

/// Bayesian online change point detection of the mean of a Gaussian of variance 1 (Adams and MacKay 2007). The statistic
/// is the log odds that the mean has changed within the latest residuals.
pub(super) struct OnlineChangePoint {
    /// By run length: its probability, the sum of its residuals.
    runs: VecDeque<(f64, f64)>,
}

impl OnlineChangePoint {
    /// Probability of a change in a step.
    const HAZARD: f64 = 1e-3;
    /// Variance of the mean before anything is known of it.
    const PRIOR_VARIANCE: f64 = 25.0;
    /// Changes within so many residuals count.
    const RECENT: usize = 12;
    /// Runs of this length and longer are one.
    const LONGEST: usize = 64;
}

impl Default for OnlineChangePoint {
    fn default() -> Self {
        Self { runs: VecDeque::from([(1.0, 0.0)]) }
    }
}

impl ChannelDetector for OnlineChangePoint {
    fn step(&mut self, residual: f64) -> f64 {
        let (mut total, mut changed) = (0.0, 0.0);
        for (length, (probability, sum)) in self.runs.iter_mut().enumerate() {
            let precision = 1.0 / Self::PRIOR_VARIANCE + length as f64;
            let variance = 1.0 + 1.0 / precision;
            let error = residual - *sum / precision;
            let weight = *probability * (-0.5 * error * error / variance).exp() / variance.sqrt();
            changed += weight * Self::HAZARD;
            *probability = weight * (1.0 - Self::HAZARD);
            *sum += residual;
            total += weight;
        }
        self.runs.push_front((changed, 0.0));
        if self.runs.len() > Self::LONGEST + 1
            && let Some((probability, sum)) = self.runs.pop_back()
            && let Some(last) = self.runs.back_mut()
        {
            // The sum over the longest run is scaled to the length that it is taken for.
            let kept = Self::LONGEST as f64 / (Self::LONGEST + 1) as f64;
            let share = last.0 / (last.0 + probability).max(f64::MIN_POSITIVE);
            last.1 = share * last.1 + (1.0 - share) * sum * kept;
            last.0 += probability;
        }
        // Where every run has become impossible, the latest one has just begun.
        if total > 0.0 {
            self.runs.iter_mut().for_each(|(probability, _)| *probability /= total);
        } else {
            *self = Self::default();
        }
        let recent: f64 = self.runs.iter().take(Self::RECENT).map(|(p, _)| p).sum();
        let older: f64 = self.runs.iter().skip(Self::RECENT).map(|(p, _)| p).sum();
        recent.max(f64::MIN_POSITIVE).ln() - older.max(f64::MIN_POSITIVE).ln()
    }
}

/// The error of the prediction from the previous residuals, in units of its healthy standard deviation.
pub(super) struct Autoregression {
    coefficients: Vec<f64>,
    deviation: f64,
    latest: VecDeque<f64>,
}

impl Autoregression {
    /// The number of previous residuals that predict the next.
    pub(super) const ORDER: usize = 8;

    /// Fits the coefficients to healthy series: the solution of the Yule-Walker equations by Levinson's recursion.
    pub(super) fn fitted<'a>(series: impl Iterator<Item = &'a [f64]>) -> Self {
        let mut covariances = [0.0; Self::ORDER + 1];
        for values in series {
            for (lag, covariance) in covariances.iter_mut().enumerate() {
                let later = values.iter().skip(lag);
                *covariance += later.zip(values).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        let power = covariances[0].max(f64::MIN_POSITIVE);
        let mut coefficients: Vec<f64> = Vec::new();
        let mut error = 1.0;
        for order in 1..=Self::ORDER {
            let known = coefficients.iter().enumerate();
            let explained: f64 =
                known.map(|(place, a)| a * covariances[order - 1 - place] / power).sum();
            let reflection = (covariances[order] / power - explained) / error;
            let reversed: Vec<f64> = coefficients.iter().rev().copied().collect();
            coefficients.iter_mut().zip(reversed).for_each(|(a, b)| *a -= reflection * b);
            coefficients.push(reflection);
            error = (error * (1.0 - reflection * reflection)).max(1e-12);
        }
        Self { coefficients, deviation: error.sqrt(), latest: VecDeque::new() }
    }

    /// The same before its first residual.
    pub(super) fn fresh(&self) -> Self {
        let Self { coefficients, deviation, .. } = self;
        Self { coefficients: coefficients.clone(), deviation: *deviation, latest: VecDeque::new() }
    }
}

impl Autoregression {
    /// The error of the prediction of the next residual, which is independent of all before in healthy series.
    fn innovation(&mut self, residual: f64) -> f64 {
        let predicted: f64 = self.coefficients.iter().zip(&self.latest).map(|(a, x)| a * x).sum();
        self.latest.push_front(residual);
        self.latest.truncate(Self::ORDER);
        (residual - predicted) / self.deviation
    }
}

impl ChannelDetector for Autoregression {
    fn step(&mut self, residual: f64) -> f64 {
        self.innovation(residual).abs()
    }
}

/// A detector of independent residuals, given the errors of prediction.
pub(super) struct Whitened<D>(pub(super) Autoregression, pub(super) D);

impl<D: ChannelDetector> ChannelDetector for Whitened<D> {
    fn step(&mut self, residual: f64) -> f64 {
        self.1.step(self.0.innovation(residual))
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Mean number of independent normal residuals until the statistic exceeds the limit.
    fn run_length<D: ChannelDetector>(limit: f64, new: impl Fn() -> D) -> f64 {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let runs = 4000;
        let mut steps = 0_u64;
        for _ in 0..runs {
            let mut detector = new();
            loop {
                steps += 1;
                let residual: f64 = StandardNormal.sample(&mut random);
                if detector.step(residual) > limit {
                    break;
                }
            }
        }
        steps as f64 / f64::from(runs)
    }

    #[test]
    fn average_run_lengths_are_those_of_the_textbook() {
        // Montgomery, Introduction to Statistical Quality Control, 7th ed.: table 9.3 (k = 1/2, h = 4 and 5), table
        // 9.11 (λ = 0.2, L = 2.962), three-sigma limits. The standard error is 1/sqrt(4000) of each.
        let cases = [
            (run_length(4.0, Cusum::default), 168.0),
            (run_length(5.0, Cusum::default), 465.0),
            (run_length(2.962, Ewma::default), 500.0),
            (run_length(3.0, || Shewhart), 370.4),
        ];
        for (measured, stated) in cases {
            assert!((measured / stated - 1.0).abs() < 0.06, "{measured} {stated}");
        }
    }

    #[test]
    fn sums_and_ratios_are_those_computed_by_hand() {
        let (mut chi, mut glr) = (ChiSquared::default(), Glr::default());
        assert_eq!([1.0, -2.0, 3.0].map(|x| chi.step(x)), [1.0, 5.0, 14.0]);
        // After 1, -2, 3: 9/2 from the last alone, 1/4 from two, 4/6 from three.
        assert_eq!([1.0, -2.0, 3.0].map(|x| glr.step(x)), [0.5, 2.0, 4.5]);
        // 2, 2, 2: 36/6 from all three.
        let mut glr = Glr::default();
        assert_eq!([2.0, 2.0, 2.0].map(|x| glr.step(x)), [2.0, 4.0, 6.0]);
    }

    /// The log odds by summation over all places of the latest change, with the density of each stretch from its
    /// covariance matrix, diagonal plus constant, in closed form.
    fn explicit_odds(values: &[f64]) -> f64 {
        let evidence = |stretch: &[f64]| {
            let (n, v) = (stretch.len() as f64, OnlineChangePoint::PRIOR_VARIANCE);
            let (sum, squares) =
                (stretch.iter().sum::<f64>(), stretch.iter().map(|x| x * x).sum::<f64>());
            let quadratic: f64 = squares - sum * sum * v / (1.0 + n * v);
            (-0.5 * quadratic).exp() / (1.0 + n * v).sqrt()
        };
        // probability[n]: of the first n values, whatever their changes; a change is possible after each value.
        let (h, n) = (OnlineChangePoint::HAZARD, values.len());
        let mut begins = vec![1.0];
        for end in 1..=n {
            let sum = (0..end).map(|from| {
                begins[from]
                    * (1.0 - h).powi((end - from - 1) as i32)
                    * evidence(&values[from..end])
                    * h
            });
            begins.push(sum.sum());
        }
        let stays = |from: usize| {
            begins[from] * (1.0 - h).powi((n - from) as i32) * evidence(&values[from..])
        };
        let all: Vec<f64> = (0..n).map(stays).chain([begins[n]]).rev().collect();
        let recent: f64 = all.iter().take(OnlineChangePoint::RECENT).sum();
        let older: f64 = all.iter().skip(OnlineChangePoint::RECENT).sum();
        (recent / older).ln()
    }

    #[test]
    fn change_points_have_the_odds_of_explicit_summation() {
        let mut values: Vec<f64> = (0..40).map(|k| f64::from(k * 7 % 5) * 0.4 - 0.8).collect();
        values[30..].iter_mut().for_each(|value| *value += 2.5);
        let mut detector = OnlineChangePoint::default();
        let odds: Vec<f64> = values.iter().map(|value| detector.step(*value)).collect();
        for n in [13, 30, 34, 40] {
            let explicit = explicit_odds(&values[..n]);
            assert!((odds[n - 1] - explicit).abs() < 1e-9 * explicit.abs().max(1.0), "{n}");
        }
        assert!(odds[39] > 0.0 && odds[29] < 0.0, "{odds:?}");
    }

    #[test]
    fn an_autoregressive_process_is_recognised() {
        // x = 0.6 x' - 0.3 x'' + e
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut series = vec![0.0, 0.0];
        for k in 2..200_000 {
            let noise: f64 = StandardNormal.sample(&mut random);
            series.push(0.6 * series[k - 1] - 0.3 * series[k - 2] + noise);
        }
        let mut fitted = Autoregression::fitted([&series[..]].into_iter());
        let ideal = [0.6, -0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for (coefficient, ideal) in fitted.coefficients.iter().zip(ideal) {
            assert!((coefficient - ideal).abs() < 0.02, "{:?}", fitted.coefficients);
        }
        // σ of the noise over that of the process: 1/sqrt(Σψ²) = sqrt((1-φ2)²-φ1²)·sqrt((1+φ2)/(1-φ2)).
        let share = ((1.3_f64.powi(2) - 0.36) * 0.7 / 1.3).sqrt();
        assert!((fitted.deviation - share).abs() < 0.01, "{} {share}", fitted.deviation);
        fitted.step(1.0);
        assert!((fitted.step(0.6) - 0.0).abs() < 0.05);
    }
}
