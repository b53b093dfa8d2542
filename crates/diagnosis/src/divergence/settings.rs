//! What tunes the divergence of a channel.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Largest window that is accepted; the cost of a step grows with its square.
pub const MAX_WINDOW: usize = 256;
/// Largest lag that is accepted.
pub const MAX_LAG: usize = 4096;
/// Largest sliding interval that is accepted, in vectors.
pub const MAX_INTERVAL: usize = 10_000_000;

/// Over which vectors the running Gaussian is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Interval {
    /// All since the start (the paper's simulation study).
    Growing,
    /// The latest `vectors` vectors (the paper's "deletion of points").
    Sliding {
        /// M, the number of vectors.
        vectors: usize,
    },
}

impl Interval {
    /// M of a sliding interval.
    #[must_use]
    pub fn vectors(self) -> Option<usize> {
        match self {
            Interval::Growing => None,
            Interval::Sliding { vectors } => Some(vectors),
        }
    }
}

impl fmt::Display for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Interval::Growing => f.write_str("all residual vectors since the start"),
            Interval::Sliding { vectors } => write!(f, "the latest {vectors} residual vectors"),
        }
    }
}

/// Window, lag and interval of a module's divergences.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DivergenceSettings {
    /// w: samples in a lagged vector (eq. 15), 1 to [`MAX_WINDOW`].
    pub window: usize,
    /// l: steps between the two compared Gaussians (eq. 19), 1 to [`MAX_LAG`].
    pub lag: usize,
    /// Growing or sliding.
    pub interval: Interval,
}

/// A setting out of its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingsError {
    /// Window out of range.
    #[error("window is {0}; use 1 to {MAX_WINDOW} samples")]
    Window(usize),
    /// Lag out of range.
    #[error("lag is {0}; use 1 to {MAX_LAG} steps")]
    Lag(usize),
    /// Interval out of range.
    #[error("interval is {0} vectors; use 2 to {MAX_INTERVAL}, or growing")]
    Interval(usize),
    /// Prior scatter out of range.
    #[error("prior scatter is {0}; use a finite number above 0, in squared units of the residual")]
    PriorScatter(f64),
}

impl DivergenceSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// The first setting out of its range.
    pub fn check(&self) -> Result<(), SettingsError> {
        if !(1..=MAX_WINDOW).contains(&self.window) {
            return Err(SettingsError::Window(self.window));
        }
        if !(1..=MAX_LAG).contains(&self.lag) {
            return Err(SettingsError::Lag(self.lag));
        }
        if let Interval::Sliding { vectors } = self.interval
            && !(2..=MAX_INTERVAL).contains(&vectors)
        {
            return Err(SettingsError::Interval(vectors));
        }
        Ok(())
    }
}

impl SettingsError {
    /// Checks a prior scatter ε: the scatter of a channel starts at ε·I. It stands for the sensor's
    /// noise floor and keeps a stuck or silent channel well defined.
    ///
    /// # Errors
    /// A value that is not finite or not above 0.
    pub fn check_prior_scatter(prior_scatter: f64) -> Result<(), SettingsError> {
        let usable = prior_scatter.is_finite() && prior_scatter > 0.0;
        if usable { Ok(()) } else { Err(SettingsError::PriorScatter(prior_scatter)) }
    }
}
