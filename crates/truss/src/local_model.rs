//! A module's local model in discrete time: actuator forces in, gage elongations out.
//!
//! This is eq. 6 and 7 for one module alone, driven by the actuator forces that its own pressure
//! sensors let it observe. Whatever comes from wind, loads and neighbours is missing from it.

use crate::assembly::Mechanics;
use crate::modal::Modes;
use crate::modal_stepper::ModalStepper;
use crate::model_error::ModelError;
use crate::structure::Structure;

/// Far longer than any step of a sampled system \[s\].
const LONGEST_STEP_S: f64 = 1.0;

/// The local model of one module, with all its modes.
#[derive(Debug, Clone)]
pub struct LocalModel {
    stepper: ModalStepper,
}

impl LocalModel {
    /// The model of a structure that is one module, from [`Structure::local`] or from a file.
    ///
    /// # Errors
    /// A structure from which no model follows, or a step that is not above 0 or absurdly long.
    pub fn new(local: &Structure, dt_s: f64) -> Result<LocalModel, ModelError> {
        if !(dt_s > 0.0 && dt_s <= LONGEST_STEP_S) {
            return Err(ModelError::TimeStep { value: dt_s });
        }
        let mechanics = Mechanics::assemble(local)?;
        let modes = Modes::of(&mechanics, local.damping, None)?;
        let stepper = ModalStepper::new(&modes, dt_s, &mechanics.actuator_map, &mechanics.gage_map);
        Ok(LocalModel { stepper })
    }

    /// Number of actuators.
    #[must_use]
    pub fn actuator_count(&self) -> usize {
        self.stepper.input_count()
    }

    /// Number of gages.
    #[must_use]
    pub fn gage_count(&self) -> usize {
        self.stepper.output_count()
    }

    /// Puts the model into static equilibrium under constant actuator forces \[N\], one for each
    /// actuator.
    pub fn settle(&mut self, forces_n: &[f64]) {
        self.stepper.settle(forces_n);
    }

    /// Advances by one step during which the actuator forces \[N\] are constant. Allocates nothing.
    pub fn step(&mut self, forces_n: &[f64]) {
        self.stepper.step(forces_n);
    }

    /// Writes the elongation that each gage should read now \[m\]. Allocates nothing.
    pub fn elongations(&self, out: &mut [f64]) {
        self.stepper.outputs(out);
    }
}
