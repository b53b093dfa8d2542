//! Settings that replace the recorded ones.

use std::collections::BTreeMap;

use diagnosis::residual::ActuatorResidual;
use diagnosis::{ModuleSetup, Rule};
use vocabulary::ModuleName;

/// The settings to change.
#[derive(Debug, Clone, Default)]
pub struct ReplaySettings {
    /// Complete setups, by module.
    pub setups: BTreeMap<ModuleName, ModuleSetup>,
    /// Factor on every threshold.
    pub threshold_factor: Option<f64>,
    /// The isolation rule.
    pub rule: Option<Rule>,
    /// The residual by which actuators are monitored.
    pub residual: Option<ActuatorResidual>,
}

impl ReplaySettings {
    /// Whether any setting is changed.
    #[must_use]
    pub fn is_any(&self) -> bool {
        !self.setups.is_empty()
            || self.threshold_factor.is_some()
            || self.rule.is_some()
            || self.residual.is_some()
    }

    /// A module's setup with these settings.
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
