//! The divergence straight from its definition (eq. 15, 18, 19), in 256 bits.
//!
//! Nothing is shared with the estimator: every Gaussian is formed from its vectors alone, and the
//! inverse is taken through a factorisation of the whole covariance.

#![allow(dead_code, reason = "each test uses its own part of this")]
#![allow(
    clippy::unwrap_used,
    clippy::needless_range_loop,
    reason = "test code, close to the formulas"
)]

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;

type Real = FBig<HalfEven, 2>;
const PRECISION: usize = 256;

fn real(x: f64) -> Real {
    Real::try_from(x).unwrap().with_precision(PRECISION).value()
}

/// What the definition is asked for.
pub struct Definition {
    pub window: usize,
    pub lag: usize,
    /// Vectors in the interval, 0 for growing.
    pub interval: usize,
    pub prior_scatter: f64,
}

struct Gaussian {
    mean: Vec<Real>,
    covariance: Vec<Vec<Real>>,
}

/// Unit lower triangular L and diagonal D of a symmetric matrix.
struct Factors {
    lower: Vec<Vec<Real>>,
    diagonal: Vec<Real>,
}

impl Definition {
    /// D at the sample with position `index`; `None` while undefined.
    pub fn divergence(&self, samples: &[f64], index: usize) -> Option<f64> {
        let now = self.gaussian(samples, index)?;
        let then = self.gaussian(samples, index.checked_sub(self.lag)?)?;
        let w = self.window;
        let factors = factor(&now.covariance);
        let mut trace = real(0.0);
        for column in 0..w {
            let c: Vec<Real> = (0..w).map(|row| then.covariance[row][column].clone()).collect();
            trace += &solve(&factors, &c)[column];
        }
        let shift: Vec<Real> = (0..w).map(|i| &now.mean[i] - &then.mean[i]).collect();
        let solved = solve(&factors, &shift);
        let mut distance = real(0.0);
        for i in 0..w {
            distance += &shift[i] * &solved[i];
        }
        let log_ratio = log_determinant(&factors) - log_determinant(&factor(&then.covariance));
        let doubled = trace + distance - real(w as f64) + log_ratio;
        Some((doubled / real(2.0)).to_f64().value())
    }

    fn gaussian(&self, samples: &[f64], index: usize) -> Option<Gaussian> {
        let w = self.window;
        let first = w - 1;
        if index < first + 1 {
            return None;
        }
        let available = index - first + 1;
        let count = if self.interval == 0 { available } else { available.min(self.interval) };
        let vectors: Vec<&[f64]> =
            (index + 1 - count..=index).map(|e| &samples[e + 1 - w..=e]).collect();
        let n = real(count as f64);
        let mean: Vec<Real> = (0..w)
            .map(|i| vectors.iter().fold(real(0.0), |sum, v| sum + real(v[i])) / &n)
            .collect();
        let degrees = real(count as f64 - 1.0);
        let mut covariance = vec![vec![real(0.0); w]; w];
        let deviations: Vec<Vec<Real>> =
            vectors.iter().map(|v| (0..w).map(|i| real(v[i]) - &mean[i]).collect()).collect();
        for i in 0..w {
            for j in 0..=i {
                let mut sum = if i == j { real(self.prior_scatter) } else { real(0.0) };
                for u in &deviations {
                    sum += &u[i] * &u[j];
                }
                let value = sum / &degrees;
                covariance[j][i] = value.clone();
                covariance[i][j] = value;
            }
        }
        Some(Gaussian { mean, covariance })
    }
}

fn factor(matrix: &[Vec<Real>]) -> Factors {
    let w = matrix.len();
    let mut lower = vec![vec![real(0.0); w]; w];
    let mut diagonal = vec![real(0.0); w];
    for j in 0..w {
        for i in j..w {
            let mut value = matrix[i][j].clone();
            for k in 0..j {
                value -= &lower[i][k] * &lower[j][k] * &diagonal[k];
            }
            if i == j {
                diagonal[j] = value;
                lower[j][j] = real(1.0);
            } else {
                lower[i][j] = value / &diagonal[j];
            }
        }
    }
    Factors { lower, diagonal }
}

fn solve(factors: &Factors, right: &[Real]) -> Vec<Real> {
    let w = right.len();
    let mut x = right.to_vec();
    for i in 0..w {
        for k in 0..i {
            let step = &factors.lower[i][k] * &x[k];
            x[i] -= step;
        }
    }
    for i in 0..w {
        x[i] = &x[i] / &factors.diagonal[i];
    }
    for i in (0..w).rev() {
        for k in i + 1..w {
            let step = &factors.lower[k][i] * &x[k];
            x[i] -= step;
        }
    }
    x
}

fn log_determinant(factors: &Factors) -> Real {
    factors.diagonal.iter().fold(real(0.0), |sum, d| sum + d.ln())
}

/// Relative error, or absolute where the value is near zero: at most 1 when within tolerance.
pub fn error_in_tolerances(found: f64, expected: f64) -> f64 {
    (found - expected).abs() / (1e-9 * expected.abs()).max(1e-12)
}
