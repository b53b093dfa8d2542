//! The Kullback–Leibler divergence of a residual's running Gaussian (section 4.2 of the paper).

mod accumulator;
mod bank;
mod estimator;
mod history;
mod lanes;
mod recent;
mod settings;

pub use bank::DivergenceBank;
pub use settings::{
    DivergenceSettings, Interval, MAX_INTERVAL, MAX_LAG, MAX_WINDOW, SettingsError,
};

/// Why the Gaussian of a channel could not be kept and was restarted.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error, serde::Serialize, serde::Deserialize,
)]
pub enum Violation {
    /// The scatter lost positive definiteness, or a number overflowed.
    #[error("scatter no longer positive definite and finite")]
    ScatterLost,
    /// Gaps have filled the history: the oldest vector of the interval was overwritten.
    #[error("too many gaps within one interval")]
    TooManyGaps,
    /// The divergence came out clearly negative, which none can be.
    #[error("divergence came out negative")]
    NegativeDivergence,
}

/// What one sample led to.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum DivergenceOutcome {
    /// Not enough vectors yet.
    Undefined,
    /// The divergence D ≥ 0.
    Defined {
        /// D_KL(N_{k−l} ‖ N_k).
        divergence: f64,
        /// Vectors taken since the channel started; in sliding mode not all are still held.
        age: u64,
    },
    /// A numerical violation: everything was forgotten and the channel starts again.
    Restarted(Violation),
}

impl DivergenceOutcome {
    /// The divergence, if defined.
    #[must_use]
    pub fn divergence(self) -> Option<f64> {
        match self {
            DivergenceOutcome::Defined { divergence, .. } => Some(divergence),
            DivergenceOutcome::Undefined | DivergenceOutcome::Restarted(_) => None,
        }
    }
}
