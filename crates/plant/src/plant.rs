//! The whole plant, step by step.
//!
//! Sample k: the structure's elongations and the chambers' pressures are measured, the controller
//! turns them into demands. Then all moves on to k + 1: the pressures under the demands of sample
//! k, the structure under the average of the forces at both ends of the step and the wind in its
//! middle.

use nalgebra::DVector;
use truss::fault::Fault;
use truss::ids::{ComponentPath, ModuleName, Step};
use truss::{ModalStepper, Modes, Structure};

use crate::controller::{Controller, Design, beside, gage_noise_m};
use crate::equilibrium::Equilibrium;
use crate::equipment::check_equipment;
use crate::error::PlantError;
use crate::gage::{GageState, Gages};
use crate::hydraulics::{ActuatorState, HydraulicParameters, Hydraulics};
use crate::injection::{InjectError, Injections, Place};
use crate::parameters::PlantParameters;
use crate::pressure_sensor::PressureSensors;
use crate::signals::Signals;
use crate::tower::{Conditions, Tower};
use crate::wind_loads::WindLoads;

/// The simulated tower.
#[derive(Debug, Clone)]
pub struct Plant {
    structure: ModalStepper,
    /// Elongations under the weight of the live loads \[m\].
    live_elongations_m: Vec<f64>,
    wind: WindLoads,
    hydraulics: Hydraulics,
    /// Of the true hardware, by which observed pressures become observed forces.
    hydraulic_parameters: HydraulicParameters,
    gages: Gages,
    pressure_sensors: PressureSensors,
    controller: Controller,
    injections: Injections,
    conditions: Conditions,
    step_s: f64,
    next_step: Step,
    signals: Signals,
    buffers: Buffers,
}

/// Working values of one step, all modules concatenated.
#[derive(Debug, Clone)]
struct Buffers {
    elongations_m: Vec<f64>,
    pressures_pa: Vec<[f64; 2]>,
    observed_forces_n: Vec<f64>,
    force_noise_n: Vec<f64>,
    demands_n: Vec<f64>,
    forces_n: Vec<f64>,
    /// Inputs of the structure: actuator forces, then the levels' forces in x and in y.
    inputs_n: Vec<f64>,
}

impl Plant {
    /// A plant whose controller knows structure and parameters exactly, live loads apart. It stands
    /// in equilibrium under mean wind.
    ///
    /// # Errors
    /// See [`Plant::with_believed`].
    pub fn new(
        structure: &Structure,
        parameters: &PlantParameters,
        seed: u64,
    ) -> Result<Self, PlantError> {
        Self::with_believed(structure, structure, parameters, parameters, seed)
    }

    /// A plant whose controller was designed on a `believed` structure and believed parameters.
    ///
    /// # Errors
    /// Parameters out of range, a structure without a model, weights without a controller, other
    /// equipment in truth than believed, or no equilibrium within the actuators' limits.
    pub fn with_believed(
        truth: &Structure,
        believed: &Structure,
        true_parameters: &PlantParameters,
        believed_parameters: &PlantParameters,
        seed: u64,
    ) -> Result<Self, PlantError> {
        true_parameters.check()?;
        believed_parameters.check()?;
        check_equipment(truth, believed)?;
        let design = Design::new(believed, believed_parameters)?;
        let tower = Tower::new(truth, true_parameters, seed)?;
        Self::assemble(tower, truth, true_parameters, &design, seed)
    }

    /// Puts actuators, sensors and controller onto a tower, all in equilibrium.
    fn assemble(
        tower: Tower,
        truth: &Structure,
        parameters: &PlantParameters,
        design: &Design,
        seed: u64,
    ) -> Result<Self, PlantError> {
        let (step_s, hydraulics) = (parameters.step_s, &parameters.hydraulics);
        let wind_map = tower.wind_map();
        let live = tower.live_elongations(parameters.loads.gravity_m_per_s2)?;
        let mean_wind = DVector::from_column_slice(tower.wind.at_start());
        let at_rest = Equilibrium::solve(
            design,
            &tower.elongations(&tower.mechanics.actuator_map)?,
            &(tower.elongations(&wind_map)? * mean_wind + &live),
            hydraulics.demand_limit_n,
        )?;
        let inputs_n = [&at_rest.forces_n, tower.wind.at_start()].concat();
        let input_map = beside(&tower.mechanics.actuator_map, &wind_map);
        let modes = Modes::of(&tower.mechanics, truth.damping, None);
        let mut structure =
            ModalStepper::new(&modes, step_s, &input_map, &tower.mechanics.gage_map);
        structure.settle(&inputs_n);
        let (actuators, gages) = (at_rest.forces_n.len(), live.len());
        Ok(Self {
            structure,
            live_elongations_m: live.as_slice().to_vec(),
            wind: tower.wind,
            hydraulics: Hydraulics::new(hydraulics, step_s, &at_rest.forces_n),
            hydraulic_parameters: hydraulics.clone(),
            gages: Gages::new(&gage_noise_m(truth, parameters), seed),
            pressure_sensors: PressureSensors::new(hydraulics, actuators, seed),
            controller: Controller::new(
                design,
                hydraulics.demand_limit_n,
                at_rest.state,
                at_rest.forces_n,
            ),
            injections: Injections::new(truth),
            conditions: tower.conditions,
            step_s,
            next_step: Step(0),
            signals: Signals::new(truth),
            buffers: Buffers {
                elongations_m: vec![0.0; gages],
                pressures_pa: vec![[0.0; 2]; actuators],
                observed_forces_n: vec![0.0; actuators],
                force_noise_n: vec![0.0; actuators],
                demands_n: vec![0.0; actuators],
                forces_n: vec![0.0; actuators],
                inputs_n,
            },
        })
    }

    /// Computes the signals of the next step; the first call gives step 0. Allocates nothing.
    pub fn advance(&mut self) -> &Signals {
        self.measure();
        let buffers = &mut self.buffers;
        self.controller.step(
            &buffers.elongations_m,
            &buffers.observed_forces_n,
            &mut buffers.demands_n,
        );
        self.signals.step = self.next_step;
        self.signals.write(&buffers.demands_n, &buffers.pressures_pa, &buffers.elongations_m);
        self.move_on();
        self.next_step = self.next_step.plus(1);
        &self.signals
    }

    /// Gives a component a fault, in place of any it has; effective from the next
    /// [`Plant::advance`].
    ///
    /// # Errors
    /// No such module or component, a fault of the other kind of component, or a parameter out of
    /// range. Nothing has changed then.
    pub fn inject(&mut self, path: &ComponentPath, fault: Fault) -> Result<(), InjectError> {
        let place = self.injections.inject(path, fault)?;
        match place {
            Place::Actuator(actuator) => self.hydraulics.set(actuator, actuator_state(fault)),
            Place::Gage(gage) => self.gages.set(gage, gage_state(fault, self.step_s)),
        }
        Ok(())
    }

    /// Repairs a component; without effect on a healthy one. A repaired actuator keeps its force;
    /// its chambers are refilled to the pressures that belong to it.
    ///
    /// # Errors
    /// No such module or component.
    pub fn clear(&mut self, path: &ComponentPath) -> Result<(), InjectError> {
        match self.injections.clear(path)? {
            Some(Place::Actuator(actuator)) => {
                self.hydraulics.set(actuator, ActuatorState::Healthy);
            }
            Some(Place::Gage(gage)) => self.gages.set(gage, GageState::Healthy),
            None => {}
        }
        Ok(())
    }

    /// The faults that are present, oldest first.
    #[must_use]
    pub fn faults(&self) -> &[(ComponentPath, Fault)] {
        self.injections.present()
    }

    /// What was drawn for this run.
    #[must_use]
    pub fn conditions(&self) -> &Conditions {
        &self.conditions
    }

    /// The equipped modules, in the order of [`Signals::modules`].
    pub fn modules(&self) -> impl Iterator<Item = &ModuleName> {
        self.signals.modules.iter().map(|module| &module.module)
    }

    /// The step that the next [`Plant::advance`] computes.
    #[must_use]
    pub fn next_step(&self) -> Step {
        self.next_step
    }

    /// Reads gages and pressure sensors of this sample, and the forces that follow (eq. 8).
    fn measure(&mut self) {
        let buffers = &mut self.buffers;
        self.structure.outputs(&mut buffers.elongations_m);
        for (elongation, live) in buffers.elongations_m.iter_mut().zip(&self.live_elongations_m) {
            *elongation += live;
        }
        self.gages.read(&mut buffers.elongations_m);
        let pressures = self.hydraulics.pressures_pa();
        self.pressure_sensors.read(pressures, &mut buffers.pressures_pa);
        self.hydraulics.forces(&mut buffers.forces_n);
        let observed = buffers.observed_forces_n.iter_mut().zip(&mut buffers.force_noise_n);
        for ((observed, noise), (measured, force)) in
            observed.zip(buffers.pressures_pa.iter().zip(&buffers.forces_n))
        {
            *observed = self.hydraulic_parameters.force_n(*measured);
            *noise = *observed - force;
        }
    }

    /// Moves pressures, wind and structure on by one step.
    fn move_on(&mut self) {
        let Buffers { inputs_n, forces_n, demands_n, force_noise_n, .. } = &mut self.buffers;
        let (actuators, levels) = inputs_n.split_at_mut(forces_n.len());
        actuators.copy_from_slice(forces_n);
        self.hydraulics.step(demands_n, force_noise_n);
        self.hydraulics.forces(forces_n);
        for (mean, after) in actuators.iter_mut().zip(forces_n) {
            *mean = 0.5 * (*mean + *after);
        }
        self.wind.next(levels);
        self.structure.step(inputs_n);
    }
}

fn actuator_state(fault: Fault) -> ActuatorState {
    let leaking = |internal, external_a, external_b| ActuatorState::Leaking {
        internal,
        external_a,
        external_b,
    };
    match fault {
        Fault::InternalLeakage { area_m2 } => leaking(area_m2, 0.0, 0.0),
        Fault::ExternalLeakageA { area_m2 } => leaking(0.0, area_m2, 0.0),
        Fault::ExternalLeakageB { area_m2 } => leaking(0.0, 0.0, area_m2),
        Fault::HardOver {} => ActuatorState::HardOver,
        // Gage faults never come here: the kinds are compared before.
        Fault::Bias { .. } | Fault::RandomWalk { .. } | Fault::ZeroOutput {} => {
            ActuatorState::Healthy
        }
    }
}

fn gage_state(fault: Fault, step_s: f64) -> GageState {
    match fault {
        Fault::Bias { offset_m } => GageState::Bias { offset_m },
        Fault::RandomWalk { drift_m_per_s, increment_m } => GageState::RandomWalk {
            mean_m: drift_m_per_s * step_s,
            deviation_m: increment_m,
            offset_m: 0.0,
        },
        Fault::ZeroOutput {} => GageState::ZeroOutput,
        // Actuator faults never come here: the kinds are compared before.
        Fault::InternalLeakage { .. }
        | Fault::ExternalLeakageA { .. }
        | Fault::ExternalLeakageB { .. }
        | Fault::HardOver {} => GageState::Healthy,
    }
}
