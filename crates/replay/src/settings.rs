//! Other settings than the recorded ones.

use std::collections::BTreeMap;

use diagnosis::residual::ActuatorResidual;
use diagnosis::{ModuleSetup, Rule};
use vocabulary::ModuleName;

/// What is to be different.
#[derive(Debug, Clone, Default)]
pub struct ReplaySettings {
    /// Whole setups, by module.
    pub setups: BTreeMap<ModuleName, ModuleSetup>,
    /// A factor on every threshold.
    pub threshold_factor: Option<f64>,
    /// The rule of isolation.
    pub rule: Option<Rule>,
    /// By which residual actuators are watched.
    pub residual: Option<ActuatorResidual>,
}

impl ReplaySettings {
    /// Is anything different?
    #[must_use]
    pub fn is_any(&self) -> bool {
        !self.setups.is_empty()
            || self.threshold_factor.is_some()
            || self.rule.is_some()
            || self.residual.is_some()
    }

    /// A module's setup with these.
    #[must_use]
    pub fn applied_to(&self, recorded: ModuleSetup) -> ModuleSetup {
        let mut setup = self.setups.get(&recorded.module).cloned().unwrap_or(recorded);
        if let Some(factor) = self.threshold_factor {
            setup.thresholds.iter_mut().for_each(|threshold| *threshold *= factor);
        }
        if let Some(rule) = self.rule {
            setup.isolation.rule = rule;
        }
        if let Some(residual) = self.residual {
            setup.detection.actuator_residual = residual;
        }
        setup
    }
}
