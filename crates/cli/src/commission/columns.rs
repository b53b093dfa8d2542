//! Which columns of a table of samples belong to which signals.

use diagnosis::{Measurements, ModuleSetup};
use vocabulary::{Component, RunId, Step};

/// The columns of a module's samples: demands, pressures and elongations.
#[derive(Debug, Default)]
pub(super) struct SignalColumns {
    actuators: usize,
    names: Vec<String>,
}

impl SignalColumns {
    /// Finds the columns of a module's signals.
    ///
    /// # Errors
    /// In words, which of them is missing.
    pub(super) fn find(header: &[String], setup: &ModuleSetup) -> Result<SignalColumns, String> {
        let signals = signals(setup);
        if let Some(missing) = signals.iter().find(|name| !header.contains(name)) {
            return Err(format!(
                "missing column `{missing}`; give every signal of the module's components"
            ));
        }
        let is_actuator = |component: &Component| matches!(component, Component::Actuator(_));
        let actuators = setup.components().iter().filter(|c| is_actuator(c)).count();
        Ok(SignalColumns { actuators, names: signals })
    }

    /// Their names, in the order of [`SignalColumns::sample`].
    pub(super) fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    /// The sample of a row; NaN is a signal without a value.
    pub(super) fn sample(&self, step: u64, signals: &[f64]) -> Measurements {
        let (demands, rest) = signals.split_at(self.actuators.min(signals.len()));
        let (pressures, elongations) = rest.split_at((2 * self.actuators).min(rest.len()));
        let (chambers, _) = pressures.as_chunks::<2>();
        Measurements {
            run: RunId(0),
            step: Step(step),
            demands_n: demands.to_vec(),
            pressures_pa: chambers.to_vec(),
            elongations_m: elongations.to_vec(),
        }
    }
}

/// Demands of all actuators, both pressures of each, elongations of all gages.
fn signals(setup: &ModuleSetup) -> Vec<String> {
    let components = setup.components();
    let of = |component: &Component, signal: &str| format!("{}/{component}/{signal}", setup.module);
    let (actuators, gages): (Vec<_>, Vec<_>) =
        components.iter().partition(|component| matches!(component, Component::Actuator(_)));
    let demands = actuators.iter().map(|actuator| of(actuator, "demand_n"));
    let pressures = actuators
        .iter()
        .flat_map(|actuator| ["pressure_a_pa", "pressure_b_pa"].map(|signal| of(actuator, signal)));
    let elongations = gages.iter().map(|gage| of(gage, "elongation_m"));
    demands.chain(pressures).chain(elongations).collect()
}
