//! Quantiles of what was measured.

/// The value nearest to this share of the way from the first of the sorted values to the last; of two
/// as near, the larger.
///
/// # Panics
/// If there are no values.
#[must_use]
pub fn quantile<T: Copy>(sorted: &[T], share: f64) -> T {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

/// Quantiles of values in any order; not numbers if there are no values.
#[must_use]
pub fn quantiles<const N: usize>(mut values: Vec<f64>, shares: [f64; N]) -> [f64; N] {
    if values.is_empty() {
        return [f64::NAN; N];
    }
    values.sort_by(f64::total_cmp);
    shares.map(|share| quantile(&values, share))
}
