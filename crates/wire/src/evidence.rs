//! A channel at one step.

use names::Step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a verdict rests on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Evidence {
    /// The step.
    pub step: Step,
    /// The residual: \[N\] for an actuator, \[m\] for a gage.
    pub residual: f64,
    /// Where the residual was before: its slow mean, in the same unit.
    pub level: f64,
    /// The divergence; `null` while undefined.
    pub divergence: Option<f64>,
    /// The threshold of the divergence.
    pub threshold: f64,
    /// Divergence by threshold; 0 while undefined.
    pub ratio: f64,
}
