//! The discrete-time algebraic Riccati equation.
//!
//! X = AᵀXA − AᵀXB (R + BᵀXB)⁻¹ BᵀXA + Q
//!
//! solved by the structure-preserving doubling algorithm (E. K.-W. Chu, H.-Y. Fan, W.-W. Lin and
//! C.-S. Wang, "Structure-preserving algorithms for periodic discrete-time algebraic Riccati
//! equations", Int. J. Control 77(8), 2004): with G = B R⁻¹ Bᵀ, H = Q and W = I + G H,
//!
//! - A ← A W⁻¹ A
//! - G ← G + A W⁻¹ G Aᵀ
//! - H ← H + Aᵀ H W⁻¹ A
//!
//! H grows to X; each pass doubles the horizon, so a time constant of a million steps takes twenty passes. The same
//! equation with (Aᵀ, Cᵀ) in place of (A, B) gives the Kalman filter.

use nalgebra::DMatrix;

/// More passes than any horizon in use: 2^60 steps.
const MAX_PASSES: usize = 60;

/// Relative change of X at which the iteration ends.
const TOLERANCE: f64 = 1e-14;

/// Why the equation could not be solved.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RiccatiError {
    /// The dimensions of the four matrices do not match.
    #[error("the matrices do not fit: A is {a:?}, B is {b:?}, Q is {q:?}, R is {r:?}")]
    Shapes {
        /// Rows and columns of A; n × n is expected.
        a: (usize, usize),
        /// Rows and columns of B; n × m is expected.
        b: (usize, usize),
        /// Rows and columns of Q; n × n is expected.
        q: (usize, usize),
        /// Rows and columns of R; m × m is expected.
        r: (usize, usize),
    },
    /// The weight of the inputs (or the noise of the outputs) is not positive definite.
    #[error("R is not positive definite; use positive weights")]
    InputWeight,
    /// An intermediate matrix is singular or not finite.
    #[error("doubling found no stabilising solution of the equation")]
    NoSolution,
}

/// The stabilising solution X (n × n, symmetric) for A (n × n), B (n × m), Q (n × n, symmetric, at
/// least semidefinite) and R (m × m, symmetric positive definite).
///
/// # Errors
/// Matrices that do not match, an R that is not positive definite, or no stabilising solution.
pub fn solve_discrete(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &DMatrix<f64>,
    r: &DMatrix<f64>,
) -> Result<DMatrix<f64>, RiccatiError> {
    check_shapes(a, b, q, r)?;
    let input_weight = r.clone().cholesky().ok_or(RiccatiError::InputWeight)?;
    let mut doubling =
        Doubling { a: a.clone(), g: b * input_weight.solve(&b.transpose()), h: q.clone() };
    for _ in 0..MAX_PASSES {
        let change = doubling.pass()?;
        if change <= TOLERANCE {
            return Ok(symmetric(&doubling.h));
        }
    }
    Err(RiccatiError::NoSolution)
}

/// The gain K = (R + BᵀXB)⁻¹ BᵀXA (m × n) for a solution X.
///
/// # Errors
/// R + BᵀXB is not positive definite.
pub fn gain(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    r: &DMatrix<f64>,
    x: &DMatrix<f64>,
) -> Result<DMatrix<f64>, RiccatiError> {
    let weighted = b.transpose() * x;
    let total = symmetric(&(r + &weighted * b));
    let factor = total.cholesky().ok_or(RiccatiError::InputWeight)?;
    Ok(factor.solve(&(weighted * a)))
}

fn check_shapes(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: &DMatrix<f64>,
    r: &DMatrix<f64>,
) -> Result<(), RiccatiError> {
    let (states, inputs) = b.shape();
    let square = (states, states);
    let fits = a.shape() == square && q.shape() == square && r.shape() == (inputs, inputs);
    if fits {
        Ok(())
    } else {
        Err(RiccatiError::Shapes { a: a.shape(), b: b.shape(), q: q.shape(), r: r.shape() })
    }
}

struct Doubling {
    a: DMatrix<f64>,
    g: DMatrix<f64>,
    h: DMatrix<f64>,
}

impl Doubling {
    /// One doubling pass; returns the largest change of H relative to its largest entry.
    fn pass(&mut self) -> Result<f64, RiccatiError> {
        let size = self.a.nrows();
        let factor = (DMatrix::identity(size, size) + &self.g * &self.h).lu();
        let solve = |right: &DMatrix<f64>| factor.solve(right).ok_or(RiccatiError::NoSolution);
        let solved_a = solve(&self.a)?;
        let solved_g = solve(&self.g)?;
        let transposed = self.a.transpose();
        let increment = symmetric(&(&transposed * &self.h * &solved_a));
        self.g = symmetric(&(&self.g + &self.a * solved_g * transposed));
        self.h += &increment;
        self.a = &self.a * solved_a;
        let scale = self.h.amax().max(f64::MIN_POSITIVE);
        let change = increment.amax() / scale;
        // `amax` ignores NaN, a sum does not.
        if self.h.sum().is_finite() && change.is_finite() {
            Ok(change)
        } else {
            Err(RiccatiError::NoSolution)
        }
    }
}

/// The symmetric part, so that rounding does not accumulate in the antisymmetric one.
fn symmetric(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    (matrix + matrix.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scalar(value: f64) -> DMatrix<f64> {
        DMatrix::from_element(1, 1, value)
    }

    #[test]
    fn a_scalar_equation_has_its_closed_form() {
        // x = a²x − a²b²x²/(r + b²x) + q with a = b = q = r = 1: x² = x + 1, the golden ratio.
        let one = scalar(1.0);
        let x = solve_discrete(&one, &one, &one, &one).unwrap();
        assert!((x[(0, 0)] - (1.0 + 5.0_f64.sqrt()) / 2.0).abs() < 1e-14);
    }

    #[test]
    fn without_inputs_that_act_the_equation_is_lyapunovs() {
        let x = solve_discrete(&scalar(0.5), &scalar(0.0), &scalar(3.0), &scalar(1.0)).unwrap();
        assert!((x[(0, 0)] - 4.0).abs() < 1e-13);
    }

    #[test]
    fn what_cannot_be_solved_is_a_named_error() {
        let one = scalar(1.0);
        let solve =
            |a: f64, b: f64, r: f64| solve_discrete(&scalar(a), &scalar(b), &one, &scalar(r));
        assert_eq!(solve(1.0, 1.0, -1.0), Err(RiccatiError::InputWeight));
        assert_eq!(solve(2.0, 0.0, 1.0), Err(RiccatiError::NoSolution));
        assert_eq!(solve(f64::NAN, 1.0, 1.0), Err(RiccatiError::NoSolution));
        let wide = DMatrix::zeros(1, 2);
        assert!(matches!(
            solve_discrete(&one, &wide, &one, &one),
            Err(RiccatiError::Shapes { b: (1, 2), .. })
        ));
    }
}
