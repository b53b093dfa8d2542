//! A plant and its diagnosers in one process.

use std::collections::{BTreeMap, VecDeque};
use std::mem;

use diagnosis::{Diagnoser, GivenOrder, GivenOrderKind, Measurements, ModuleSetup, OrderRefusal};
use plant::{InjectError, Plant, StrokeError, StrokeTest};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use vocabulary::{
    Change, Component, ComponentPath, CorrectedReadings, ModuleName, ReadingSource, RunId, Step,
    fault::{Fault, FaultKind},
};

use crate::group::{DiagnoserGroup, GroupError, Identify, RigEvent};

/// A fault in a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TimedFault {
    /// First step with the fault.
    pub at: Step,
    /// First step without the fault; `None` if it stays.
    pub until: Option<Step>,
    /// The component.
    pub component: ComponentPath,
    /// The fault.
    pub fault: Fault,
}

/// Injects and clears the faults that are due at `step`.
fn apply(faults: &[TimedFault], step: Step, plant: &mut Plant) -> Result<(), InjectError> {
    for fault in faults {
        if fault.until == Some(step) {
            plant.clear(&fault.component)?;
        }
        if fault.at == step {
            plant.inject(&fault.component, fault.fault)?;
        }
    }
    Ok(())
}

/// Why a rig cannot be created or advanced.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// A diagnoser's setup is invalid.
    #[error(transparent)]
    Setup(#[from] GroupError),
    /// The setups do not match the plant's modules in number or order.
    #[error("diagnosers for `{setups}`, but the plant has `{plant}`; give them in this order")]
    Modules {
        /// Modules of the setups.
        setups: String,
        /// Modules of the plant.
        plant: String,
    },
    /// A fault does not fit the plant.
    #[error(transparent)]
    Inject(#[from] InjectError),
    /// A stroke does not fit the plant.
    #[error(transparent)]
    StrokeTest(#[from] StrokeError),
}

/// A plant and one diagnoser for each of its equipped modules.
#[derive(Debug, Clone)]
pub struct Rig {
    plant: Plant,
    run: RunId,
    group: DiagnoserGroup,
    samples: Vec<Measurements>,
    faults: Vec<TimedFault>,
    /// The latest samples of all modules, as the publisher keeps them; so many of them.
    kept: VecDeque<Vec<Measurements>>,
    keep: usize,
    /// The corrected readings of each module, if the controller is given them.
    corrected: Option<Vec<CorrectedReadings>>,
    /// So many steps after the verdict.
    late_steps: u64,
    /// Modules do not hear each other's forces.
    forces_unheard: bool,
    /// This share of corrected readings and forces is lost, drawn from this.
    lost: f64,
    losses: ChaCha8Rng,
    /// Since when each gage is declared faulty.
    faulty_since: BTreeMap<ComponentPath, Step>,
}

impl Rig {
    /// Creates a plant with diagnosers; the setups must be in the order of the plant's modules.
    ///
    /// # Errors
    /// A setup is invalid, or belongs to another module than the plant's.
    pub fn new(
        plant: Plant,
        setups: Vec<ModuleSetup>,
        faults: Vec<TimedFault>,
        run: RunId,
    ) -> Result<Self, RigError> {
        check_modules(&plant, &setups)?;
        Ok(Self {
            plant,
            run,
            group: DiagnoserGroup::new(setups)?,
            samples: Vec::new(),
            faults,
            kept: VecDeque::new(),
            keep: 0,
            corrected: None,
            late_steps: 0,
            forces_unheard: false,
            lost: 0.0,
            losses: ChaCha8Rng::seed_from_u64(0),
            faulty_since: BTreeMap::new(),
        })
    }

    /// The diagnosers, in the order of the plant's modules.
    #[must_use]
    pub fn diagnosers(&self) -> &[Diagnoser] {
        self.group.diagnosers()
    }

    /// The plant.
    #[must_use]
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The latest sample of each module, in the order of the plant's modules; none before the first step.
    #[must_use]
    pub fn samples(&self) -> &[Measurements] {
        &self.samples
    }

    /// The changes so far whose ratio is final, with their last steps as far as they are known.
    pub fn settled_changes(&self) -> impl Iterator<Item = (ComponentPath, &Change)> {
        self.group.settled_changes()
    }

    /// The same without the faults of a component.
    #[must_use]
    pub fn without_faults_of(mut self, component: &ComponentPath) -> Self {
        self.faults.retain(|fault| fault.component != *component);
        self
    }

    /// From now on the controller is given the corrected reading of each gage that is declared faulty, a step later, and
    /// another `late_steps` after the verdict.
    pub fn correct(&mut self, late_steps: u64) {
        self.late_steps = late_steps;
        self.corrected = Some(vec![CorrectedReadings::default(); self.diagnosers().len()]);
    }

    /// Modules do not hear each other's forces any more: readings are corrected from their own values.
    pub fn silence_forces(&mut self) {
        self.forces_unheard = true;
    }

    /// From now on this share of the modules' messages about gages and forces is lost: the controller uses the latest that
    /// arrived.
    pub fn lose_readings(&mut self, share: f64, seed: u64) {
        (self.lost, self.losses) = (share, ChaCha8Rng::seed_from_u64(seed));
    }

    /// Limits the innovations of the controller, see [`Plant::limit_innovations`].
    pub fn limit_innovations(&mut self, largest_strain: f64) {
        self.plant.limit_innovations(Some(largest_strain));
    }

    /// Shuts a cylinder off, see [`Plant::shut_off`].
    ///
    /// # Errors
    /// No such cylinder.
    pub fn shut_off(&mut self, cylinder: &ComponentPath) -> Result<(), RigError> {
        Ok(self.plant.shut_off(cylinder, true)?)
    }

    /// The controller does without a cylinder, see [`Plant::reallocate`].
    ///
    /// # Errors
    /// No such cylinder.
    pub fn reallocate(&mut self, cylinder: &ComponentPath) -> Result<(), RigError> {
        Ok(self.plant.reallocate(cylinder, true)?)
    }

    /// An operator declares a component faulty.
    pub fn declare(&mut self, path: &ComponentPath) {
        self.order_about(path, GivenOrderKind::Declare);
    }

    /// An operator resets a component, whatever the evidence.
    pub fn reset(&mut self, path: &ComponentPath) {
        self.order_about(path, GivenOrderKind::Reset { force: true });
    }

    fn order_about(&mut self, path: &ComponentPath, kind: GivenOrderKind) {
        let place = self.diagnosers().iter().position(|one| *one.module() == path.module);
        let by = "study".to_owned();
        let order = GivenOrder { kind, by, on_behalf_of: None, note: None };
        if let Some(place) = place {
            self.order(place, path.component.clone(), order);
        }
    }

    /// The corrected readings of a module, by its index, at the latest step, if the controller is given them.
    #[must_use]
    pub fn corrected(&self, place: usize) -> Option<&CorrectedReadings> {
        self.corrected.as_ref()?.get(place)
    }

    fn give_corrected(&mut self) -> Result<(), InjectError> {
        let Some(mut corrected) = mem::take(&mut self.corrected) else { return Ok(()) };
        let mut is_lost = || self.lost > 0.0 && self.losses.random_bool(self.lost);
        if !self.forces_unheard && !is_lost() {
            self.group.exchange_forces();
        }
        for (readings, diagnoser) in corrected.iter_mut().zip(self.group.diagnosers()) {
            if is_lost() {
                continue;
            }
            diagnoser.write_readings(readings);
            let gages = diagnoser.components().iter();
            let gages = gages.filter(|one| matches!(one, Component::Sensor(_)));
            let entries = readings.elongations_m.iter().zip(&readings.source);
            for (component, (elongation_m, source)) in gages.zip(entries) {
                let module = diagnoser.module().clone();
                let gage = ComponentPath { module, component: component.clone() };
                if *source == ReadingSource::Own {
                    self.faulty_since.remove(&gage);
                    self.plant.replace_reading(&gage, None)?;
                    continue;
                }
                let now = self.plant.next_step();
                let since = *self.faulty_since.entry(gage.clone()).or_insert(now);
                let is_told = now.since(since) >= self.late_steps;
                let replaced = elongation_m.filter(|_| *source == ReadingSource::Replaced);
                self.plant.replace_reading(&gage, replaced.filter(|_| is_told))?;
            }
        }
        self.corrected = Some(corrected);
        Ok(())
    }

    /// Starts a stroke of a cylinder at the next step.
    ///
    /// # Errors
    /// See [`Plant::begin_stroke`].
    pub fn begin_stroke(&mut self, stroke: StrokeTest) -> Result<(), RigError> {
        self.plant.begin_stroke(stroke)?;
        Ok(())
    }

    /// Returns all events so far, in order, and clears them.
    pub fn take_occurrences(&mut self) -> Vec<RigEvent> {
        self.group.take_occurrences()
    }

    /// Advances by `steps` steps.
    ///
    /// # Errors
    /// A fault that does not fit the plant.
    pub fn run(&mut self, steps: u64) -> Result<(), RigError> {
        (0..steps).try_for_each(|_| self.step())
    }

    /// Advances by one step: every diagnoser processes its sample, then queries are answered.
    ///
    /// # Errors
    /// A fault that does not fit the plant.
    pub fn step(&mut self) -> Result<(), RigError> {
        self.step_without(|_| false)
    }

    /// Advances by one step whose sample is lost for some diagnosers, given by their index.
    ///
    /// # Errors
    /// A fault that does not fit the plant.
    pub fn step_without(&mut self, is_lost: impl Fn(usize) -> bool) -> Result<(), RigError> {
        let step = self.plant.next_step();
        apply(&self.faults, step, &mut self.plant)?;
        advance(&mut self.plant, self.run, &mut self.samples);
        for (place, sample) in self.samples.iter().enumerate() {
            if !is_lost(place) {
                self.group.take_sample(place, sample);
            }
        }
        self.give_corrected()?;
        if self.keep > 0 {
            let reused = (self.kept.len() == self.keep).then(|| self.kept.pop_front()).flatten();
            let mut newest = reused.unwrap_or_default();
            newest.clone_from(&self.samples);
            self.kept.push_back(newest);
        }
        Ok(())
    }

    /// Enables identification of faults, see [`DiagnoserGroup::identify`].
    pub fn identify(&mut self, without: Option<FaultKind>) {
        self.group.identify(without);
    }

    /// Likewise with another function.
    pub fn identify_by(&mut self, identify: Identify) {
        self.group.identify_by(identify);
    }

    /// Stores the latest `count` samples of each module for restarted diagnosers.
    pub fn keep_samples(&mut self, count: usize) {
        self.keep = count;
    }

    /// Restarts a diagnoser, given by its index, with its stored state and the samples that are still stored. What it was
    /// asked meanwhile stays unanswered; its peers ask again.
    ///
    /// # Errors
    /// Its setup is invalid.
    pub fn restart(&mut self, place: usize) -> Result<(), RigError> {
        self.group.restart(place, self.kept.iter().map(|samples| &samples[place]))?;
        Ok(())
    }

    /// Issues an operator's command to a diagnoser, given by its index. Returns why it was refused, if so.
    pub fn order(
        &mut self,
        place: usize,
        component: Component,
        order: GivenOrder,
    ) -> Option<OrderRefusal> {
        self.group.order(place, component, order)
    }
}

/// Advances the plant and copies its signals into samples, one for each of its modules.
pub(crate) fn advance(plant: &mut Plant, run: RunId, samples: &mut Vec<Measurements>) {
    let signals = plant.advance();
    if samples.is_empty() {
        let empty = Measurements {
            run,
            step: Step(0),
            demands_n: Vec::new(),
            pressures_pa: Vec::new(),
            elongations_m: Vec::new(),
        };
        *samples = vec![empty; signals.modules.len()];
    }
    for (sample, module) in samples.iter_mut().zip(&signals.modules) {
        sample.step = signals.step;
        sample.demands_n.clone_from(&module.demands_n);
        sample.pressures_pa.clone_from(&module.pressures_pa);
        sample.elongations_m.clone_from(&module.elongations_m);
    }
}

pub(crate) fn check_modules(plant: &Plant, setups: &[ModuleSetup]) -> Result<(), RigError> {
    let of_plant: Vec<&str> = plant.modules().map(ModuleName::as_str).collect();
    let of_setups: Vec<&str> = setups.iter().map(|setup| setup.module.as_str()).collect();
    if of_plant == of_setups {
        return Ok(());
    }
    Err(RigError::Modules { setups: of_setups.join(", "), plant: of_plant.join(", ") })
}
