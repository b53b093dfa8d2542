//! What the controller is designed with.

use serde::{Deserialize, Serialize};

use crate::check::Checks;

/// The controller. Marks: \[C\] computed, \[E\] engineering estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerParameters {
    /// Modes in the controller's model, lowest first: 12 \[E\].
    pub modes: usize,
    /// Weight r of the squared demands, R = r·I \[1/N² against twice the modal energy in J\]: 5e-8 \[C\].
    pub effort_weight: f64,
    /// The filter takes the gages' noise for this many times its deviation: 5 \[C\].
    pub gage_noise_factor: f64,
    /// Base wind speed that the filter is designed for \[m/s\]: 11, the mean of U(8, 14) \[E\].
    pub base_speed_m_per_s: f64,
}

impl Default for ControllerParameters {
    fn default() -> Self {
        Self { modes: 12, effort_weight: 5e-8, gage_noise_factor: 5.0, base_speed_m_per_s: 11.0 }
    }
}

impl ControllerParameters {
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.require(
            "controller.modes",
            (1..=100).contains(&self.modes),
            self.modes,
            "1 to 100 modes",
        );
        checks.positive("controller.effort_weight", self.effort_weight);
        checks.positive("controller.gage_noise_factor", self.gage_noise_factor);
        checks.positive("controller.base_speed_m_per_s", self.base_speed_m_per_s);
    }
}
