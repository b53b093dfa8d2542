//! Static condensation of the rotations.
//!
//! Rotations carry neither mass nor load, so K_rt·u + K_rr·φ = 0 holds at all times and
//! K = K_tt − K_tr·K_rr⁻¹·K_rt acts between translations alone, without approximation.

use nalgebra::DMatrix;

use crate::cholesky::{Cholesky, Singular};

/// Stiffness between the translations once the rotations follow freely \[N/m\].
///
/// The first `translations` rows and columns of `stiffness` are the translations.
///
/// # Errors
/// A combination of rotations without resistance, counted from the first rotation.
pub(crate) fn condense(
    stiffness: &DMatrix<f64>,
    translations: usize,
) -> Result<DMatrix<f64>, Singular> {
    let rotations = stiffness.nrows() - translations;
    let mut condensed = stiffness.view((0, 0), (translations, translations)).into_owned();
    if rotations == 0 {
        return Ok(condensed);
    }
    let own = stiffness.view((translations, translations), (rotations, rotations)).into_owned();
    let coupling = stiffness.view((translations, 0), (rotations, translations)).into_owned();
    let following = Cholesky::of(&own)?.solve(&coupling);
    for column in 0..translations {
        // Only the lower triangle is computed, so that the result is symmetric to the last bit.
        for row in column..translations {
            let relief: f64 =
                (0..rotations).map(|r| coupling[(r, row)] * following[(r, column)]).sum();
            condensed[(row, column)] -= relief;
            condensed[(column, row)] = condensed[(row, column)];
        }
    }
    Ok(condensed)
}
