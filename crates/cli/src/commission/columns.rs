//! Which columns of a table of samples belong to which signals.

use diagnosis::{Measurements, ModuleSetup};
use vocabulary::{Component, ComponentPath, RunId, Signal, Step};

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
        let find = |(path, signal): (ComponentPath, Signal)| {
            // The table is of this module by its file's name.
            signal.find(header, &path, true).cloned().ok_or_else(|| {
                let missing = signal.column(&path);
                format!("missing column `{missing}`; give every signal of the module's components")
            })
        };
        let names = signals(setup).into_iter().map(find).collect::<Result<_, _>>()?;
        let is_actuator = |component: &Component| matches!(component, Component::Actuator(_));
        let actuators = setup.components().iter().filter(|c| is_actuator(c)).count();
        Ok(SignalColumns { actuators, names })
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
fn signals(setup: &ModuleSetup) -> Vec<(ComponentPath, Signal)> {
    let path = |component| ComponentPath { module: setup.module.clone(), component };
    let (actuators, gages): (Vec<ComponentPath>, Vec<ComponentPath>) = (setup.components())
        .into_iter()
        .map(path)
        .partition(|path| matches!(path.component, Component::Actuator(_)));
    let of = |paths: &[ComponentPath], signals: &[Signal]| -> Vec<(ComponentPath, Signal)> {
        let each = paths.iter().flat_map(|p| signals.iter().map(|signal| (p.clone(), *signal)));
        each.collect()
    };
    let demands = of(&actuators, &[Signal::Demand]);
    let pressures = of(&actuators, &[Signal::PressureA, Signal::PressureB]);
    [demands, pressures, of(&gages, &[Signal::Elongation])].concat()
}
