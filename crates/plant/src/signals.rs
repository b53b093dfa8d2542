//! The output of the plant at each step: the samples of all equipped modules.

use truss::Structure;
use vocabulary::{ModuleName, Step};

/// Signals of one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Signals {
    /// The sampling instant.
    pub step: Step,
    /// The equipped modules, in the structure's order.
    pub modules: Vec<ModuleSignals>,
}

/// Signals of one module; actuators and gages in the order of the module's own lists.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleSignals {
    /// The module.
    pub module: ModuleName,
    /// Force demanded of each actuator by the controller, based on the measurements of the same sample \[N\].
    pub demands_n: Vec<f64>,
    /// Measured pressures in the chambers A and B of each actuator \[Pa\].
    pub pressures_pa: Vec<[f64; 2]>,
    /// Reading of each gage \[m\]; NaN without a signal.
    pub elongations_m: Vec<f64>,
    /// What each gage would read without noise, gain error or fault \[m\].
    pub true_elongations_m: Vec<f64>,
}

impl Signals {
    pub(crate) fn new(structure: &Structure) -> Self {
        let module = |module: &truss::Module| ModuleSignals {
            module: module.name.clone(),
            demands_n: vec![0.0; module.actuators.len()],
            pressures_pa: vec![[0.0; 2]; module.actuators.len()],
            elongations_m: vec![0.0; module.gages.len()],
            true_elongations_m: vec![0.0; module.gages.len()],
        };
        Self { step: Step(0), modules: structure.equipped().map(module).collect() }
    }

    /// Distributes concatenated signals to the modules at these positions, in order.
    pub(crate) fn write(
        &mut self,
        places: &[usize],
        demands: &[f64],
        pressures: &[[f64; 2]],
        elongations: &[f64],
        true_elongations: &[f64],
    ) {
        let (mut actuator, mut gage) = (0, 0);
        for &place in places {
            let Some(module) = self.modules.get_mut(place) else { continue };
            let actuators = module.demands_n.len();
            copy(&mut module.demands_n, demands, actuator);
            copy(&mut module.pressures_pa, pressures, actuator);
            copy(&mut module.elongations_m, elongations, gage);
            copy(&mut module.true_elongations_m, true_elongations, gage);
            actuator += actuators;
            gage += module.elongations_m.len();
        }
    }
}

fn copy<T: Copy>(target: &mut [T], source: &[T], start: usize) {
    for (to, from) in target.iter_mut().zip(source.iter().skip(start)) {
        *to = *from;
    }
}
