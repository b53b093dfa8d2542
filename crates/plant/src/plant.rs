//! The whole plant: one or several unconnected towers, each with its own controller.
//!
//! Unconnected parts do not move each other, so they are stepped one by one. All parts have the same wind direction,
//! mean speed and loads on nodes; gusts, live loads and noise are drawn separately for each part.

use truss::{ModelError, Structure};
use vocabulary::{ComponentPath, ModuleName, Step, fault::Fault};

use crate::error::PlantError;
use crate::injection::{InjectError, Injections, Slot};
use crate::nodal_loads::NodalLoads;
use crate::parameters::PlantParameters;
use crate::part::PlantPart;
use crate::signals::Signals;
use crate::stroke::{StrokeError, StrokeTest};
use crate::wind_loads::WindConditions;

/// Difference between the seeds of successive parts, so large that runs with successive seeds have no part in common.
/// The first part has the seed of the run.
const SEEDS_APART: u64 = 0x9e37_79b9_7f4a_7c15;

/// The values drawn for a run.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnConditions {
    /// Largest base wind speed of the run \[m/s\].
    pub base_speed_m_per_s: f64,
    /// The direction that the wind blows to, from the x axis towards y \[rad\].
    pub wind_direction_rad: f64,
    /// Live load of each level that can move, from the bottom up, part by part \[kg\].
    pub live_loads_kg: Vec<f64>,
}

/// The simulated tower or towers.
#[derive(Debug, Clone)]
pub struct Plant {
    parts: Vec<PlantPart>,
    injections: Injections,
    conditions: DrawnConditions,
    next_step: Step,
    signals: Signals,
}

impl Plant {
    /// A plant whose controller knows structure and parameters exactly, except for live loads. It starts in equilibrium
    /// under mean wind.
    ///
    /// # Errors
    /// See [`Plant::with_nominal`].
    pub fn new(
        structure: &Structure,
        parameters: &PlantParameters,
        seed: u64,
    ) -> Result<Self, PlantError> {
        Self::with_nominal(structure, structure, parameters, parameters, seed)
    }

    /// A plant whose controller was designed on a `nominal` structure and nominal parameters.
    ///
    /// # Errors
    /// Parameters out of range, a structure without a valid model, weights without a controller, equipment that differs
    /// from the nominal one, or no equilibrium within the actuators' limits.
    pub fn with_nominal(
        truth: &Structure,
        nominal: &Structure,
        true_parameters: &PlantParameters,
        nominal_parameters: &PlantParameters,
        seed: u64,
    ) -> Result<Self, PlantError> {
        true_parameters.check()?;
        nominal_parameters.check()?;
        check_equipment(truth, nominal)?;
        let wind = WindConditions::draw(&true_parameters.wind, seed);
        let nodal_loads = NodalLoads::new(truth, true_parameters, seed)?;
        let (true_parts, nominal_parts) = parts_alike(truth, nominal);
        let injections = Injections::new(&true_parts);
        let mut parts = Vec::with_capacity(true_parts.len());
        for (number, pair) in (0..).zip(true_parts.iter().zip(&nominal_parts)) {
            parts.push(PlantPart::new(
                pair,
                (true_parameters, nominal_parameters),
                (wind.clone(), nodal_loads.of_part(pair.0)),
                seed.wrapping_add(SEEDS_APART.wrapping_mul(number)),
                places(truth, pair.0),
            )?);
        }
        if parts.is_empty() {
            return Err(ModelError::NothingMoves.into());
        }
        let loads = parts.iter().flat_map(|part| part.live_loads_kg().iter().copied());
        let conditions = DrawnConditions {
            base_speed_m_per_s: wind.speed.largest(),
            wind_direction_rad: wind.direction_rad,
            live_loads_kg: loads.collect(),
        };
        let signals = Signals::new(truth);
        Ok(Self { parts, injections, conditions, next_step: Step(0), signals })
    }

    /// Computes the signals of the next step; the first call gives step 0. Allocates nothing.
    pub fn advance(&mut self) -> &Signals {
        self.signals.step = self.next_step;
        for part in &mut self.parts {
            part.advance(&mut self.signals);
        }
        self.next_step = self.next_step.plus(1);
        &self.signals
    }

    /// What acts on the structure until the next sample, for a program that steps a structure of its own beside it: the force
    /// of each actuator in the mean of the step, pushing its ends apart, and the wind's force on each level in x and y in
    /// its middle, from the lowest that can move up, part by part \[N\]. Before the first sample the loads of the
    /// equilibrium at the start. Loads on given nodes are not among them.
    #[must_use]
    pub fn loads(&self) -> (Vec<f64>, Vec<[f64; 2]>) {
        let (mut actuators_n, mut levels_n) = (Vec::new(), Vec::new());
        for part in &self.parts {
            let (forces_n, wind_n) = part.loads();
            actuators_n.extend_from_slice(forces_n);
            let (x, y) = wind_n.split_at(wind_n.len() / 2);
            levels_n.extend(x.iter().zip(y).map(|(x, y)| [*x, *y]));
        }
        (actuators_n, levels_n)
    }

    /// The next sample measures these elongations in place of those of the plant's own structure, all gages in order \[m\];
    /// the effects of live loads' weights and of temperature are added. Returns whether their number is right; otherwise
    /// nothing was changed.
    pub fn respond(&mut self, elongations_m: &[f64]) -> bool {
        if elongations_m.len() != self.parts.iter().map(PlantPart::gages).sum::<usize>() {
            return false;
        }
        let mut rest = elongations_m;
        for part in &mut self.parts {
            let (own, others) = rest.split_at(part.gages());
            part.respond(own);
            rest = others;
        }
        true
    }

    /// Injects a fault into a component, replacing any present one; effective from the next [`Plant::advance`].
    ///
    /// # Errors
    /// No such module or component, a fault of the other kind of component, or a parameter out of range; then nothing
    /// was changed.
    pub fn inject(&mut self, path: &ComponentPath, fault: Fault) -> Result<(), InjectError> {
        let place = self.injections.inject(path, fault)?;
        if let Some(part) = self.parts.get_mut(place.part) {
            part.inject(place.slot, fault);
        }
        Ok(())
    }

    /// Repairs a component; no effect on a healthy one. A repaired actuator keeps its force; its chambers are refilled
    /// to the corresponding pressures until it follows its demand again.
    ///
    /// # Errors
    /// No such module or component.
    pub fn clear(&mut self, path: &ComponentPath) -> Result<(), InjectError> {
        let Some(place) = self.injections.clear(path)? else { return Ok(()) };
        if let Some(part) = self.parts.get_mut(place.part) {
            part.clear(place.slot);
        }
        Ok(())
    }

    /// Starts a stroke of a cylinder at the next [`Plant::advance`]. Each tower performs one at a time. Returns the
    /// last step, unless the stroke is cut short.
    ///
    /// # Errors
    /// No such cylinder, a parameter out of range, or a stroke in progress; then nothing was changed.
    pub fn begin_stroke(&mut self, stroke: StrokeTest) -> Result<Step, StrokeError> {
        let unknown = || StrokeError::Actuator {
            actuator: stroke.actuator.clone(),
            known: self.injections.actuators().collect::<Vec<_>>().join(", "),
        };
        let place = self.injections.place_of(&stroke.actuator).ok_or_else(unknown)?;
        let Slot::Actuator(actuator) = place.slot else { return Err(unknown()) };
        let part = self.parts.get_mut(place.part).ok_or_else(unknown)?;
        stroke.check(part.demand_limit_n())?;
        if let Some(other) = part.stroke() {
            return Err(StrokeError::Busy(other.actuator.clone()));
        }
        let steps = part.begin_stroke(stroke, actuator);
        Ok(self.next_step.plus(steps).minus(1))
    }

    /// Replaces a gage's reading in the controller's input by an elongation \[m\], or ends that; effective from the next
    /// [`Plant::advance`].
    ///
    /// # Errors
    /// No such gage.
    pub fn replace_reading(
        &mut self,
        gage: &ComponentPath,
        elongation_m: Option<f64>,
    ) -> Result<(), InjectError> {
        let place = self.injections.place(gage)?;
        if let (Slot::Gage(gage), Some(part)) = (place.slot, self.parts.get_mut(place.part)) {
            part.replace_reading(gage, elongation_m);
        }
        Ok(())
    }

    /// What a gage multiplies an elongation by while it is healthy: 1 but for the gain errors of
    /// [`GageParameters`](crate::GageParameters).
    ///
    /// # Errors
    /// No such gage.
    pub fn gage_gain(&self, gage: &ComponentPath) -> Result<f64, InjectError> {
        let place = self.injections.place(gage)?;
        Ok(match (place.slot, self.parts.get(place.part)) {
            (Slot::Gage(gage), Some(part)) => part.gage_gain(gage),
            _ => 1.0,
        })
    }

    /// Shuts a cylinder off, whatever its fault, or puts it back: both chambers are emptied into the tank; effective from the
    /// next [`Plant::advance`].
    ///
    /// # Errors
    /// No such cylinder.
    pub fn shut_off(
        &mut self,
        cylinder: &ComponentPath,
        is_shut_off: bool,
    ) -> Result<(), InjectError> {
        let (part, actuator) = self.cylinder(cylinder)?;
        part.shut_off(actuator, is_shut_off);
        Ok(())
    }

    /// The controller takes a cylinder's force as a given disturbance, for which the others make up, or counts on it again;
    /// effective from the next [`Plant::advance`].
    ///
    /// # Errors
    /// No such cylinder.
    pub fn reallocate(
        &mut self,
        cylinder: &ComponentPath,
        is_lost: bool,
    ) -> Result<(), InjectError> {
        let (part, actuator) = self.cylinder(cylinder)?;
        part.reallocate(actuator, is_lost);
        Ok(())
    }

    /// The part that has a cylinder, and its number there.
    fn cylinder(&mut self, path: &ComponentPath) -> Result<(&mut PlantPart, usize), InjectError> {
        let place = self.injections.place(path)?;
        match (place.slot, self.parts.get_mut(place.part)) {
            (Slot::Actuator(actuator), Some(part)) => Ok((part, actuator)),
            _ => Err(self.injections.unknown(path)),
        }
    }

    /// Limits what the controller makes of readings: their innovations count up to this strain about their mean, from two
    /// seconds later on. `None` for no limit, as at the start.
    pub fn limit_innovations(&mut self, largest_strain: Option<f64>) {
        self.parts.iter_mut().for_each(|part| part.limit_innovations(largest_strain));
    }

    /// The signals of the latest step.
    #[must_use]
    pub fn signals(&self) -> &Signals {
        &self.signals
    }

    /// Displacement of the uppermost level of each part in x and in y at the latest step, in the mean of its nodes \[m\].
    pub fn tops_m(&self) -> impl Iterator<Item = &[f64]> {
        self.parts.iter().map(PlantPart::top_m)
    }

    /// The strokes in progress.
    pub fn strokes(&self) -> impl Iterator<Item = &StrokeTest> {
        self.parts.iter().filter_map(PlantPart::stroke)
    }

    /// All components that may have a fault.
    pub fn components(&self) -> impl Iterator<Item = &ComponentPath> {
        self.injections.components()
    }

    /// The present faults, oldest first.
    #[must_use]
    pub fn faults(&self) -> &[(ComponentPath, Fault)] {
        self.injections.present()
    }

    /// The values drawn for this run.
    #[must_use]
    pub fn conditions(&self) -> &DrawnConditions {
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
}

/// Pairs of true and nominal parts; both structures undivided if their parts differ.
fn parts_alike(truth: &Structure, nominal: &Structure) -> (Vec<Structure>, Vec<Structure>) {
    let (true_parts, nominal_parts) = (truth.parts(), nominal.parts());
    let modules = |parts: &[Structure]| -> Vec<Vec<ModuleName>> {
        let names =
            |part: &Structure| part.modules.iter().map(|module| module.name.clone()).collect();
        parts.iter().map(names).collect()
    };
    if modules(&true_parts) == modules(&nominal_parts) {
        (true_parts, nominal_parts)
    } else {
        (vec![truth.clone()], vec![nominal.clone()])
    }
}

/// The positions of a part's equipped modules among those of the whole.
fn places(whole: &Structure, part: &Structure) -> Vec<usize> {
    let place =
        |module: &truss::Module| whole.equipped().position(|other| other.name == module.name);
    part.equipped().filter_map(place).collect()
}

/// Both structures must have the same channels.
fn check_equipment(truth: &Structure, nominal: &Structure) -> Result<(), PlantError> {
    let channels = |structure: &Structure| -> Vec<String> {
        let mut names = Vec::new();
        for module in &structure.modules {
            let actuators = module.actuators.iter().map(|actuator| actuator.name.to_string());
            let gages = module.gages.iter().map(|gage| gage.name.to_string());
            names.extend(actuators.chain(gages).map(|name| format!("{}/{name}", module.name)));
        }
        names
    };
    let (truth, nominal) = (channels(truth), channels(nominal));
    if truth == nominal {
        return Ok(());
    }
    let named = |names: &[String], other: &[String]| -> Vec<String> {
        names.iter().filter(|name| !other.contains(name)).map(|name| format!("`{name}`")).collect()
    };
    let mut different = named(&truth, &nominal);
    different.extend(named(&nominal, &truth));
    let different =
        if different.is_empty() { "their order".to_owned() } else { different.join(", ") };
    Err(PlantError::Equipment(different))
}
