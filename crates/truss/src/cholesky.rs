//! Cholesky factorisation that identifies the motion that makes a stiffness matrix singular.
//!
//! K = L·Lᵀ column by column, in plain loops so that the result does not depend on the machine. A pivot that has lost
//! all but [`PIVOT_TOLERANCE`] of its diagonal entry means that K·x = 0 for x = (−K₁₁⁻¹·k₁, 1, 0), a motion without
//! elastic energy.

use nalgebra::{DMatrix, DVector};

/// A pivot below this share of its diagonal entry counts as zero. Sound structures stay above
/// 1e-7; rounding in a mechanism leaves about 1e-15.
const PIVOT_TOLERANCE: f64 = 1e-11;

/// The factor L of K = L·Lᵀ.
pub(crate) struct Cholesky {
    lower: DMatrix<f64>,
}

/// A motion without resistance: K·motion = 0.
pub(crate) struct Singular {
    /// The motion, of any size.
    pub(crate) motion: DVector<f64>,
}

impl Cholesky {
    /// Factorises a symmetric positive definite matrix.
    pub(crate) fn of(matrix: &DMatrix<f64>) -> Result<Cholesky, Singular> {
        let size = matrix.nrows();
        let mut lower = matrix.clone();
        for column in 0..size {
            let pivot = lower[(column, column)];
            let floor = PIVOT_TOLERANCE * matrix[(column, column)];
            // A NaN pivot also counts as no resistance.
            if !(pivot > floor && pivot > 0.0) {
                return Err(free_motion(matrix, lower, column));
            }
            eliminate(&mut lower, column);
        }
        Ok(Cholesky { lower })
    }

    /// Solves K·x = right-hand side, in place.
    pub(crate) fn solve_in_place(&self, x: &mut [f64]) {
        forward(&self.lower, x);
        backward(&self.lower, x);
    }

    /// Solves K·X = B, column by column.
    pub(crate) fn solve(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        let mut solution = right.clone();
        for mut column in solution.column_iter_mut() {
            let mut x: Vec<f64> = column.iter().copied().collect();
            self.solve_in_place(&mut x);
            for (target, value) in column.iter_mut().zip(x) {
                *target = value;
            }
        }
        solution
    }
}

/// One step of the right-looking factorisation.
fn eliminate(lower: &mut DMatrix<f64>, column: usize) {
    let size = lower.nrows();
    let root = lower[(column, column)].sqrt();
    lower[(column, column)] = root;
    for row in column + 1..size {
        lower[(row, column)] /= root;
    }
    for other in column + 1..size {
        let factor = lower[(other, column)];
        if factor != 0.0 {
            for row in other..size {
                let product = lower[(row, column)] * factor;
                lower[(row, other)] -= product;
            }
        }
    }
}

/// Solves L·y = x over the first `x.len()` rows.
fn forward(lower: &DMatrix<f64>, x: &mut [f64]) {
    for column in 0..x.len() {
        let value = x[column] / lower[(column, column)];
        x[column] = value;
        for row in column + 1..x.len() {
            x[row] -= lower[(row, column)] * value;
        }
    }
}

/// Solves Lᵀ·y = x over the first `x.len()` rows.
fn backward(lower: &DMatrix<f64>, x: &mut [f64]) {
    for row in (0..x.len()).rev() {
        let mut sum = x[row];
        for column in row + 1..x.len() {
            sum -= lower[(column, row)] * x[column];
        }
        x[row] = sum / lower[(row, row)];
    }
}

fn free_motion(matrix: &DMatrix<f64>, lower: DMatrix<f64>, column: usize) -> Singular {
    let mut resisted: Vec<f64> = (0..column).map(|row| -matrix[(row, column)]).collect();
    forward(&lower, &mut resisted);
    backward(&lower, &mut resisted);
    let mut motion = DVector::zeros(matrix.nrows());
    for (target, value) in motion.iter_mut().zip(&resisted) {
        *target = *value;
    }
    motion[column] = 1.0;
    Singular { motion }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_it_factorised() {
        let matrix =
            DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.5, 1.0, 3.0, -1.0, 0.5, -1.0, 2.0]);
        let right = DMatrix::from_row_slice(3, 1, &[1.0, -2.0, 3.0]);
        let factor = Cholesky::of(&matrix).ok().unwrap();
        let residual = &matrix * factor.solve(&right) - right;
        assert!(residual.amax() < 1e-14);
    }

    #[test]
    fn a_singular_matrix_yields_its_null_vector() {
        let matrix =
            DMatrix::from_row_slice(3, 3, &[1.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 1.0]);
        let singular = Cholesky::of(&matrix).err().unwrap();
        assert!((&matrix * &singular.motion).amax() < 1e-14);
        assert!(singular.motion.amax() > 0.5);
    }
}
