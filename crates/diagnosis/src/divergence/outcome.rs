//! What one sample of one channel led to.

/// Why the Gaussian of a channel could not be kept and was restarted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum Violation {
    /// The scatter lost positive definiteness, or a number overflowed.
    #[error("scatter no longer positive definite and finite")]
    ScatterLost,
    /// So many gaps that the oldest vector of the interval is no longer held.
    #[error("too many gaps within one interval")]
    TooManyGaps,
    /// The divergence came out clearly negative, which none can be.
    #[error("divergence came out negative")]
    NegativeDivergence,
}

/// What one sample led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
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

impl Outcome {
    /// The divergence, if defined.
    #[must_use]
    pub fn divergence(self) -> Option<f64> {
        match self {
            Outcome::Defined { divergence, .. } => Some(divergence),
            Outcome::Undefined | Outcome::Restarted(_) => None,
        }
    }
}
