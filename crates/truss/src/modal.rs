//! The natural modes of a structure.
//!
//! With ξ = Φ·q and Φᵀ·M·Φ = I, Φᵀ·K·Φ = diag(ω²), eq. 6 falls apart into q̈ + 2·ζ·ω·q̇ + ω²·q =
//! Φᵀ·F per mode. Rayleigh damping makes ζ = α/(2ω) + β·ω/2.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::assembly::Mechanics;
use crate::model_error::ModelError;
use crate::structure::Rayleigh;

/// Permitted range of modal frequencies \[rad/s\], far beyond those of real structures, so that all quantities derived
/// from a mode are finite.
const ANGULAR_FREQUENCIES: RangeInclusive<f64> = 1e-6..=1e9;
/// The largest permitted damping ratio.
const MOST_DAMPING: f64 = 1e12;

/// Natural modes, lowest frequency first.
#[derive(Debug, Clone)]
pub struct Modes {
    /// Angular frequency of each mode (modes) \[rad/s\].
    pub angular_frequencies: DVector<f64>,
    /// Damping ratio of each mode (modes); above 1 the mode returns without oscillating.
    pub damping_ratios: DVector<f64>,
    /// Mode shapes (dofs × modes), scaled to unit modal mass [1/√kg]. The largest component of a
    /// shape is positive.
    pub shapes: DMatrix<f64>,
}

impl Modes {
    /// The lowest `count` modes, or all of them.
    ///
    /// # Errors
    /// A mode is too slow, too fast or too strongly damped for finite numbers, because a quantity in the description is
    /// in the wrong unit.
    pub fn of(
        mechanics: &Mechanics,
        damping: Rayleigh,
        count: Option<usize>,
    ) -> Result<Modes, ModelError> {
        let size = mechanics.mass.len();
        let count = count.map_or(size, |count| count.min(size));
        let scale = mechanics.mass.map(|mass| 1.0 / mass.sqrt());
        // M^(−½)·K·M^(−½) is symmetric and has the eigenvalues ω².
        let scaled =
            DMatrix::from_fn(size, size, |i, j| scale[i] * mechanics.stiffness[(i, j)] * scale[j]);
        // The largest eigenvalue is at least as large as every diagonal entry. A matrix that is thereby known to be too
        // stiff is not decomposed, because the decomposition might not terminate.
        judge(scaled.diagonal().max().sqrt(), damping)?;
        let eigen = SymmetricEigen::new(scaled);
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        order.truncate(count);

        let angular_frequencies = DVector::from_iterator(
            count,
            order.iter().map(|&mode| eigen.eigenvalues[mode].max(0.0).sqrt()),
        );
        for &angular_frequency in &angular_frequencies {
            judge(angular_frequency, damping)?;
        }
        let mut shapes = DMatrix::from_fn(size, count, |dof, mode| {
            scale[dof] * eigen.eigenvectors[(dof, order[mode])]
        });
        orient(&mut shapes);
        let damping_ratios = angular_frequencies.map(|omega| damping.damping_ratio(omega));
        Ok(Modes { angular_frequencies, damping_ratios, shapes })
    }

    /// Number of modes.
    #[must_use]
    pub fn count(&self) -> usize {
        self.angular_frequencies.len()
    }

    /// Natural frequency of each mode \[Hz\].
    #[must_use]
    pub fn frequencies_hz(&self) -> DVector<f64> {
        self.angular_frequencies.map(|omega| omega / TAU)
    }
}

/// Rejects a mode that would lead to numbers that are not finite.
fn judge(angular_frequency: f64, damping: Rayleigh) -> Result<(), ModelError> {
    let damping_ratio = damping.damping_ratio(angular_frequency);
    if ANGULAR_FREQUENCIES.contains(&angular_frequency) && damping_ratio <= MOST_DAMPING {
        return Ok(());
    }
    Err(ModelError::Mode { frequency_hz: angular_frequency / TAU, damping_ratio })
}

/// Flips each shape so that its largest component is positive.
fn orient(shapes: &mut DMatrix<f64>) {
    for mut shape in shapes.column_iter_mut() {
        let largest = shape.iamax();
        if shape[largest] < 0.0 {
            shape.neg_mut();
        }
    }
}
