//! A part of the plant that is not connected to others: a structure with its loads, actuators, sensors and controller,
//! simulated step by step.
//!
//! Sample k: the structure's elongations and the chambers' pressures are measured, and the controller computes the
//! demands. Then the state advances to k + 1: the pressures under the demands of sample k, the structure under the
//! average of the forces at both ends of the step, the other loads in its middle.

use nalgebra::DVector;
use truss::{Direction, ModalStepper, Modes, Structure};
use vocabulary::fault::Fault;

use crate::contact::Contact;
use crate::controller::{Controller, Design, beside, gage_lengths_m};
use crate::error::PlantError;
use crate::gage::{GageState, Gages};
use crate::hydraulics::{ActuatorState, HydraulicParameters, Hydraulics, Spool};
use crate::injection::Slot;
use crate::loads::{level_map, loaded_levels};
use crate::nodal_loads::NodalLoads;
use crate::parameters::PlantParameters;
use crate::pressure_sensor::PressureSensors;
use crate::signals::Signals;
use crate::slow_elongations::SlowElongations;
use crate::stroke::{StrokeTest, StrokeUnderWay};
use crate::tower::Tower;
use crate::wind_loads::WindConditions;
use crate::wind_loads::WindLoads;

/// A tower with its present state.
#[derive(Debug, Clone)]
pub(crate) struct PlantPart {
    structure: ModalStepper,
    slow_elongations: SlowElongations,
    live_loads_kg: Vec<f64>,
    wind: WindLoads,
    nodal_loads: NodalLoads,
    hydraulics: Hydraulics,
    /// Parameters of the true hardware, used to compute observed forces from observed pressures.
    hydraulic_parameters: HydraulicParameters,
    gages: Gages,
    pressure_sensors: PressureSensors,
    controller: Controller,
    stroke: Option<StrokeUnderWay>,
    /// The cylinders that the controller does without.
    is_lost: Vec<bool>,
    demand_limit_n: f64,
    gage_lengths_m: Vec<f64>,
    step_s: f64,
    /// The positions of its equipped modules among those of the whole plant.
    places: Vec<usize>,
    /// What the next sample measures in place of the elongations of its own structure \[m\].
    response_m: Option<Vec<f64>>,
    buffers: Buffers,
}

/// Working values of one step, all modules concatenated.
#[derive(Debug, Clone)]
struct Buffers {
    /// Elongation of each gage, then the displacement of the uppermost level in x and in y.
    outputs_m: Vec<f64>,
    true_elongations_m: Vec<f64>,
    elongations_m: Vec<f64>,
    /// What the controller is given in place of a gage's reading.
    replaced_m: Vec<Option<f64>>,
    /// The controller's input: what replaces a gage's reading, or its last valid reading.
    latest_m: Vec<f64>,
    pressures_pa: Vec<[f64; 2]>,
    observed_forces_n: Vec<f64>,
    force_noise_n: Vec<f64>,
    demands_n: Vec<f64>,
    forces_n: Vec<f64>,
    /// Inputs of the structure: actuator forces, those on given nodes.
    inputs_n: Vec<f64>,
    /// The wind's forces on the structure's modes.
    wind: Vec<f64>,
}

impl PlantPart {
    /// A part of the true structure with a controller designed on the nominal part. `places` are the positions of its
    /// modules' signals, `seed` is that of its gusts, loads and noise.
    pub(crate) fn new(
        (truth, nominal): (&Structure, &Structure),
        (true_parameters, nominal_parameters): (&PlantParameters, &PlantParameters),
        (wind, nodal_loads): (WindConditions, NodalLoads),
        seed: u64,
        places: Vec<usize>,
    ) -> Result<Self, PlantError> {
        let design = Design::new(nominal, nominal_parameters)?;
        let tower = Tower::new(truth, true_parameters, wind, nodal_loads, seed)?;
        Self::assemble(tower, &design, truth, true_parameters, seed, places)
    }

    /// Equips a tower with actuators, sensors and controller, all in equilibrium.
    fn assemble(
        tower: Tower,
        design: &Design,
        truth: &Structure,
        parameters: &PlantParameters,
        seed: u64,
        places: Vec<usize>,
    ) -> Result<Self, PlantError> {
        let (step_s, hydraulics) = (parameters.step_s, &parameters.hydraulics);
        let slow_elongations = tower.slow_elongations(truth, parameters, seed)?;
        let at_rest = DVector::from_column_slice(slow_elongations.elongations_m());
        let loads_n = [tower.wind.at_start(), &tower.nodal_loads.at_start()].concat();
        let load_map = beside(&tower.wind_map(), &tower.nodal_loads.map(truth, &tower.mechanics));
        let at_start = DVector::from_column_slice(&loads_n);
        let (state, forces_n) = design.at_rest(
            &tower.elongations(&tower.mechanics.actuator_map)?,
            &(tower.elongations(&load_map)? * at_start + &at_rest),
            hydraulics.demand_limit_n,
        )?;
        let inputs_n = [&forces_n[..], &tower.nodal_loads.at_start()].concat();
        let nodal_map = tower.nodal_loads.map(truth, &tower.mechanics);
        let input_map = beside(&tower.mechanics.actuator_map, &nodal_map);
        let modes = Modes::of(&tower.mechanics, truth.damping, None)?;
        let uppermost: Vec<_> = loaded_levels(truth).into_iter().rev().take(1).collect();
        let top = |direction| level_map(&tower.mechanics, &uppermost, direction);
        let outputs = beside(
            &tower.mechanics.gage_map.transpose(),
            &beside(&top(Direction::X), &top(Direction::Y)),
        );
        // What the modes feel of the wind is evaluated at its few instants, not at each step.
        let wind_map = modes.shapes.tr_mul(&tower.wind_map());
        let wind = tower.wind.mapped(&wind_map);
        let mut structure = ModalStepper::new(&modes, step_s, &input_map, &outputs.transpose());
        structure.settle(&inputs_n, wind.at_start());
        let gage_lengths_m = gage_lengths_m(truth);
        let (actuators, gages) = (forces_n.len(), gage_lengths_m.len());
        Ok(Self {
            structure,
            slow_elongations,
            live_loads_kg: tower.live_loads_kg,
            nodal_loads: tower.nodal_loads,
            hydraulics: Hydraulics::new(hydraulics, step_s, &forces_n),
            hydraulic_parameters: hydraulics.clone(),
            gages: Gages::new(&parameters.gages, &gage_lengths_m, seed),
            pressure_sensors: PressureSensors::new(hydraulics, actuators, step_s, seed),
            controller: Controller::new(design, hydraulics.demand_limit_n, step_s, state, forces_n),
            stroke: None,
            is_lost: vec![false; actuators],
            demand_limit_n: hydraulics.demand_limit_n,
            gage_lengths_m,
            step_s,
            places,
            response_m: None,
            buffers: Buffers {
                outputs_m: vec![0.0; outputs.ncols()],
                true_elongations_m: vec![0.0; gages],
                elongations_m: vec![0.0; gages],
                replaced_m: vec![None; gages],
                latest_m: vec![0.0; gages],
                pressures_pa: vec![[0.0; 2]; actuators],
                observed_forces_n: vec![0.0; actuators],
                force_noise_n: vec![0.0; actuators],
                demands_n: vec![0.0; actuators],
                forces_n: vec![0.0; actuators],
                inputs_n,
                wind: wind.at_start().to_vec(),
            },
            wind,
        })
    }

    /// Computes the signals of the next step. Allocates nothing.
    pub(crate) fn advance(&mut self, signals: &mut Signals) {
        self.measure();
        let buffers = &mut self.buffers;
        self.controller.step(&buffers.latest_m, &buffers.observed_forces_n, &mut buffers.demands_n);
        if let Some(stroke) = &mut self.stroke {
            let readings = buffers.latest_m.iter().zip(&self.gage_lengths_m);
            let goes_on =
                stroke.step(&mut buffers.demands_n, readings.map(|(m, length)| m / length));
            for demand in &mut buffers.demands_n {
                *demand = demand.clamp(-self.demand_limit_n, self.demand_limit_n);
            }
            if !goes_on {
                self.stroke = None;
            }
        }
        signals.write(
            &self.places,
            &buffers.demands_n,
            &buffers.pressures_pa,
            &buffers.elongations_m,
            &buffers.true_elongations_m,
        );
        self.move_on();
    }

    /// Injects a fault into a component, replacing any present one. The fault must match the kind of component.
    pub(crate) fn inject(&mut self, slot: Slot, fault: Fault) {
        match (slot, faulty(fault, self.step_s)) {
            (Slot::Actuator(actuator), FaultyState::Actuator(state)) => {
                self.hydraulics.set(actuator, state);
            }
            (Slot::Gage(gage), FaultyState::Gage(state)) => self.gages.set(gage, state),
            // The kinds are compared before.
            _ => {}
        }
    }

    /// Repairs a component.
    pub(crate) fn clear(&mut self, slot: Slot) {
        match slot {
            Slot::Actuator(actuator) => {
                self.hydraulics.set(actuator, ActuatorState::Healthy);
            }
            Slot::Gage(gage) => self.gages.set(gage, GageState::Healthy),
        }
    }

    /// Starts a stroke of a cylinder from the present demands. Returns its number of steps.
    pub(crate) fn begin_stroke(&mut self, stroke: StrokeTest, actuator: usize) -> u64 {
        let actuators = self.buffers.demands_n.len();
        let under_way = StrokeUnderWay::new(stroke, actuator, actuators, self.step_s);
        let steps = under_way.steps_left();
        self.stroke = Some(under_way);
        steps
    }

    /// The stroke in progress.
    pub(crate) fn stroke(&self) -> Option<&StrokeTest> {
        self.stroke.as_ref().map(|under_way| &under_way.stroke)
    }

    /// Gives the controller this in place of a gage's reading \[m\], or its reading again.
    pub(crate) fn replace_reading(&mut self, gage: usize, elongation_m: Option<f64>) {
        self.buffers.replaced_m[gage] = elongation_m;
    }

    /// What a gage multiplies an elongation by while it is healthy.
    pub(crate) fn gage_gain(&self, gage: usize) -> f64 {
        self.gages.gain(gage)
    }

    /// Limits what a reading may differ from its prediction.
    pub(crate) fn limit_innovations(&mut self, largest_strain: Option<f64>) {
        self.controller.limit_innovations(largest_strain);
    }

    /// Shuts a cylinder off, or puts it back.
    pub(crate) fn shut_off(&mut self, actuator: usize, is_shut_off: bool) {
        self.hydraulics.shut_off(actuator, is_shut_off);
    }

    /// The controller counts a cylinder as lost, or no longer.
    pub(crate) fn reallocate(&mut self, actuator: usize, is_lost: bool) {
        if std::mem::replace(&mut self.is_lost[actuator], is_lost) != is_lost {
            self.controller.reallocate(&self.is_lost);
        }
    }

    /// The next sample measures these elongations \[m\].
    pub(crate) fn respond(&mut self, elongations_m: &[f64]) {
        self.response_m = Some(elongations_m.to_vec());
    }

    /// The number of its gages.
    pub(crate) fn gages(&self) -> usize {
        self.gage_lengths_m.len()
    }

    /// What acts on the structure until the next sample: the force of each actuator, and the wind's on the levels, in x,
    /// then in y \[N\].
    pub(crate) fn loads(&self) -> (&[f64], Vec<f64>) {
        (&self.buffers.inputs_n[..self.buffers.forces_n.len()], self.wind.on_levels())
    }

    /// Displacement of the uppermost level in x and in y at the latest step, in the mean of its nodes \[m\].
    pub(crate) fn top_m(&self) -> &[f64] {
        self.buffers.outputs_m.get(self.gage_lengths_m.len()..).unwrap_or_default()
    }

    /// The largest demand \[N\].
    pub(crate) fn demand_limit_n(&self) -> f64 {
        self.demand_limit_n
    }

    /// Live load of each level that can move, from the bottom up \[kg\].
    pub(crate) fn live_loads_kg(&self) -> &[f64] {
        &self.live_loads_kg
    }

    /// Reads gages and pressure sensors, and computes the observed forces (eq. 8).
    fn measure(&mut self) {
        let buffers = &mut self.buffers;
        self.structure.outputs(&mut buffers.outputs_m);
        if let Some(response_m) = self.response_m.take() {
            buffers.outputs_m[..response_m.len()].copy_from_slice(&response_m);
        }
        let at_rest = self.slow_elongations.elongations_m();
        let both = buffers.outputs_m.iter().zip(at_rest);
        for (elongation, (moving, at_rest)) in buffers.true_elongations_m.iter_mut().zip(both) {
            *elongation = moving + at_rest;
        }
        self.slow_elongations.step();
        buffers.elongations_m.copy_from_slice(&buffers.true_elongations_m);
        self.gages.read(&mut buffers.elongations_m);
        let replaced = buffers.replaced_m.iter().zip(&buffers.elongations_m);
        for (latest, (replaced, reading)) in buffers.latest_m.iter_mut().zip(replaced) {
            let known = replaced.unwrap_or(*reading);
            if !known.is_nan() {
                *latest = known;
            }
        }
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

    /// Advances pressures, loads and structure by one step.
    fn move_on(&mut self) {
        let Buffers { inputs_n, wind, forces_n, demands_n, force_noise_n, .. } = &mut self.buffers;
        let (actuators, nodes) = inputs_n.split_at_mut(forces_n.len());
        actuators.copy_from_slice(forces_n);
        self.hydraulics.step(demands_n, force_noise_n);
        self.hydraulics.forces(forces_n);
        for (mean, after) in actuators.iter_mut().zip(forces_n) {
            *mean = 0.5 * (*mean + *after);
        }
        self.wind.next(wind);
        self.nodal_loads.next(nodes);
        self.structure.step(inputs_n, wind);
    }
}

/// What a component of either kind does.
enum FaultyState {
    Actuator(ActuatorState),
    Gage(GageState),
}

/// What a component with this fault does.
fn faulty(fault: Fault, step_s: f64) -> FaultyState {
    let leaking = |internal, external_a, external_b| {
        FaultyState::Actuator(ActuatorState::Leaking { internal, external_a, external_b })
    };
    FaultyState::Gage(match fault {
        Fault::InternalLeakage { area_m2 } => return leaking(area_m2, 0.0, 0.0),
        Fault::ExternalLeakageA { area_m2 } => return leaking(0.0, area_m2, 0.0),
        Fault::ExternalLeakageB { area_m2 } => return leaking(0.0, 0.0, area_m2),
        Fault::HardOver {} => return FaultyState::Actuator(ActuatorState::HardOver),
        Fault::Stiction { band_m3_per_s } => {
            return FaultyState::Actuator(ActuatorState::Sticking(Spool::new(band_m3_per_s)));
        }
        Fault::Bias { offset_m } => GageState::Bias { offset_m },
        Fault::Drift { drift_m_per_s } => {
            GageState::Drift { increment_m: drift_m_per_s * step_s, offset_m: 0.0 }
        }
        Fault::RandomWalk { drift_m_per_s, increment_m } => GageState::RandomWalk {
            mean_m: drift_m_per_s * step_s,
            deviation_m: increment_m,
            offset_m: 0.0,
        },
        Fault::Gain { gain } => GageState::Gain { gain },
        Fault::ZeroOutput {} => GageState::ZeroOutput,
        Fault::Stuck {} => GageState::Stuck,
        Fault::Intermittent { offset_m, closed_s, open_s } => {
            GageState::Intermittent { offset_m, contact: Contact::new(closed_s, open_s, step_s) }
        }
        Fault::NoSignal {} => GageState::NoSignal,
    })
}
