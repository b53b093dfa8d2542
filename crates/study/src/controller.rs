//! Other controllers than the shipped one: no rule of the diagnosis may rest on what one controller demands.

use std::fmt;

use plant::PlantParameters;
use serde::Serialize;

/// How a run's controller is tuned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Controller {
    /// As the plant's parameters have it.
    Shipped,
    /// Ten times the weight of the effort, and gages taken for four times as noisy: demands hardly move.
    Gentle,
    /// A tenth of the effort's weight, and gages taken at their word: demands jump by tens of kilonewtons.
    Aggressive,
    /// The same with a sixth of the shipped limit: jumps end at it.
    Saturating,
}

impl Controller {
    /// The same plant with this controller.
    pub(crate) fn of(self, parameters: &PlantParameters) -> PlantParameters {
        let mut other = parameters.clone();
        let (effort, gage_noise, limit) = match self {
            Controller::Shipped => (1.0, 1.0, 1.0),
            Controller::Gentle => (10.0, 4.0, 1.0),
            Controller::Aggressive => (0.1, 0.2, 1.0),
            Controller::Saturating => (0.1, 0.2, 1.0 / 6.0),
        };
        other.controller.effort_weight *= effort;
        other.controller.gage_noise_factor *= gage_noise;
        other.hydraulics.demand_limit_n *= limit;
        other
    }
}

impl fmt::Display for Controller {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Controller::Shipped => "shipped",
            Controller::Gentle => "gentle",
            Controller::Aggressive => "aggressive",
            Controller::Saturating => "saturating",
        })
    }
}
