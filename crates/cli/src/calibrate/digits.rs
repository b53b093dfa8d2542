//! How many digits thresholds are written with.

/// Four digits are plenty for a threshold, and pleasant to read.
pub(super) fn round(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}
