//! Fits a generalised Pareto distribution to a sample, with its uncertainty.

use super::pareto::Pareto;

/// Fewest excesses for a fit.
const FEWEST: usize = 10;
/// The search ends at e^±300 of the sample's scale.
const LONGEST_SEARCH: f64 = 300.0;

/// A sample's generalised Pareto distribution by the estimator of Zhang and Stephens: "A new and
/// efficient estimation method for the generalized Pareto distribution", Technometrics 51 (2009).
///
/// It is a posterior mean on a grid of candidates, always exists, and has about the errors of maximum likelihood or
/// smaller ones. The candidates with their weights are kept: the probability of an excess far beyond the data is the
/// mean over all of them rather than that of the mean candidate, which would be too low.
#[derive(Debug, Clone, PartialEq)]
pub struct ParetoFit {
    candidates: Vec<(f64, Pareto)>,
    estimate: Pareto,
}

impl ParetoFit {
    /// Fits positive excesses; others are ignored. `None` with fewer than 10, or if they are all equal.
    #[must_use]
    pub fn new(excesses: &[f64]) -> Option<ParetoFit> {
        let positive = |x: &f64| x.is_finite() && *x > 0.0;
        let mut rising: Vec<f64> = excesses.iter().copied().filter(positive).collect();
        rising.sort_by(f64::total_cmp);
        if rising.len() < FEWEST || rising.first() == rising.last() {
            return None;
        }
        let mut candidates: Vec<(f64, f64)> =
            grid(&rising).map(|theta| (log_likelihood(&rising, theta), theta)).collect();
        let best = candidates.iter().map(|(log, _)| *log).fold(f64::NEG_INFINITY, f64::max);
        candidates.iter_mut().for_each(|(weight, _)| *weight = (*weight - best).exp());
        let sum: f64 = candidates.iter().map(|(weight, _)| weight).sum();
        candidates.iter_mut().for_each(|(weight, _)| *weight /= sum);
        let theta = candidates.iter().map(|(weight, theta)| weight * theta).sum();
        let fit = ParetoFit {
            estimate: profile(&rising, theta),
            candidates: candidates
                .into_iter()
                .map(|(weight, theta)| (weight, profile(&rising, theta)))
                .collect(),
        };
        fit.estimate.scale.is_finite().then_some(fit)
    }

    /// The estimate.
    #[must_use]
    pub fn estimate(&self) -> Pareto {
        self.estimate
    }

    /// P(X > x) of a further excess, averaged over the uncertainty of the fit.
    #[must_use]
    pub fn survival(&self, x: f64) -> f64 {
        self.candidates.iter().map(|(weight, pareto)| weight * pareto.survival(x)).sum()
    }

    /// The x that a further excess exceeds with a probability of `survival`, above 0 and below 1; infinite if every x
    /// is exceeded more often.
    #[must_use]
    pub fn exceeded_with(&self, survival: f64) -> f64 {
        let unit = self.estimate.scale;
        let too_low = |exponent: f64| self.survival(unit * exponent.exp()) > survival;
        let (mut low, mut high) = (-LONGEST_SEARCH, LONGEST_SEARCH);
        if too_low(high) {
            return f64::INFINITY;
        }
        // after 64 halvings only rounding errors remain of the interval
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            if too_low(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        unit * high.exp()
    }

    /// Standard deviation of ln(`offset` + x), x being exceeded with a probability of `survival`, over the uncertainty
    /// of the fit; infinite if x is too large for a number.
    #[must_use]
    pub fn log_spread(&self, offset: f64, survival: f64) -> f64 {
        let logs: Vec<(f64, f64)> = (self.candidates.iter())
            .filter(|(weight, _)| *weight > 0.0)
            .map(|(weight, pareto)| (*weight, (offset + pareto.exceeded_with(survival)).ln()))
            .collect();
        let mean: f64 = logs.iter().map(|(weight, log)| weight * log).sum();
        let variance: f64 = logs.iter().map(|(weight, log)| weight * (log - mean).powi(2)).sum();
        if variance.is_finite() { variance.sqrt() } else { f64::INFINITY }
    }
}

/// Candidates for θ = −ξ/σ.
fn grid(rising: &[f64]) -> impl Iterator<Item = f64> {
    let n = rising.len() as f64;
    let quartile = rising[((n / 4.0 + 0.5) as usize).max(1) - 1];
    let largest = rising[rising.len() - 1];
    let candidates = 20 + n.sqrt() as u32;
    let of = move |j: u32| {
        let spread = 1.0 - (f64::from(candidates) / (f64::from(j) - 0.5)).sqrt();
        1.0 / largest + spread / (3.0 * quartile)
    };
    (1..=candidates).map(of)
}

/// The likeliest distribution with −ξ/σ = θ.
fn profile(rising: &[f64], theta: f64) -> Pareto {
    let n = rising.len() as f64;
    let shape = rising.iter().map(|x| (-theta * x).ln_1p()).sum::<f64>() / n;
    let scale = if theta == 0.0 { rising.iter().sum::<f64>() / n } else { -shape / theta };
    Pareto { shape, scale }
}

/// ln of the profile likelihood of θ.
fn log_likelihood(rising: &[f64], theta: f64) -> f64 {
    let Pareto { shape, scale } = profile(rising, theta);
    -(rising.len() as f64) * (scale.ln() + shape + 1.0)
}
