//! A channel at one step.

use crate::Step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a verdict rests on: a channel at one step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Evidence {
    /// The step.
    pub step: Step,
    /// The residual: \[N\] for an actuator, \[m\] for a gage. In a learned module, how much too large the reading is against
    /// what the other channels say, in its own unit.
    pub residual: f64,
    /// The residual's slow mean before this step, in the same unit.
    pub level: f64,
    /// The divergence D, in a learned module z' of the latest window; `null` while undefined.
    pub divergence: Option<f64>,
    /// The threshold γ of the divergence.
    pub threshold: f64,
}

impl Evidence {
    /// D/γ, 0 while undefined.
    #[must_use]
    #[inline]
    pub fn ratio(&self) -> f64 {
        self.divergence.map_or(0.0, |divergence| divergence / self.threshold)
    }
}
