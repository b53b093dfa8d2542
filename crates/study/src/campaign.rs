//! A campaign: many runs with and without faults, all made in the same way.

use diagnosis::ModuleSetup;
use names::RunId;
use plant::PlantParameters;
use truss::Structure;

use crate::calibration::plant;
use crate::closest::ClosestSoFar;
use crate::controller::Controller;
use crate::error::StudyError;
use crate::record::{NominalRecord, ScenarioRecord, Watch};
use crate::rig::{Occurrence, Rig};
use crate::scenario::{Scenario, ScenarioRanges, nominal_seed};
use crate::schedule::Schedule;

/// What all runs of a campaign have in common.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// The structure as described.
    pub structure: Structure,
    /// The nominal parameters of the plant.
    pub parameters: PlantParameters,
    /// The diagnosers, in the order of the structure's modules.
    pub setups: Vec<ModuleSetup>,
    /// By how much each run's plant differs from the nominal model; 0 for no mismatch.
    pub mismatch: f64,
    /// The controllers that runs have in turn; none for the shipped one.
    pub controllers: Vec<Controller>,
    /// Seed of the campaign.
    pub seed: u64,
    /// From what its scenarios are drawn.
    pub ranges: ScenarioRanges,
}

impl Campaign {
    /// Steps of a run with a fault.
    #[must_use]
    pub fn steps(&self) -> u64 {
        (self.ranges.length_s / self.parameters.step_s).round() as u64
    }

    /// Steps of a run without a fault.
    #[must_use]
    pub fn nominal_steps(&self) -> u64 {
        (self.ranges.nominal_s / self.parameters.step_s).round() as u64
    }

    /// Draws a scenario.
    ///
    /// # Errors
    /// The structure has no component that the scenario's fault could befall.
    pub fn scenario(&self, number: u64) -> Result<Scenario, StudyError> {
        Scenario::draw(self.seed, number, &self.structure, &self.parameters, &self.ranges)
            .ok_or(StudyError::NothingToBreak)
    }

    /// The controller of the run with this seed.
    #[must_use]
    pub fn controller_of(&self, seed: u64) -> Controller {
        let count = self.controllers.len().max(1) as u64;
        let place = usize::try_from(seed % count).unwrap_or_default();
        self.controllers.get(place).copied().unwrap_or(Controller::Shipped)
    }

    /// The rig of a run with this schedule, before its first step.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made.
    pub fn rig(&self, seed: u64, schedule: Schedule) -> Result<Rig, StudyError> {
        let parameters = self.controller_of(seed).of(&self.parameters);
        let plant = plant(&self.structure, &parameters, self.mismatch, seed)?;
        Ok(Rig::new(plant, self.setups.clone(), schedule, RunId(seed))?)
    }

    /// Runs a scenario.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made.
    pub fn run_scenario(&self, number: u64) -> Result<ScenarioRecord, StudyError> {
        self.follow_scenario(number, |_, _| Ok(()))
    }

    /// Runs a scenario and shows `each_step` the rig after every step, with what happened in it.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made, or what `each_step` fails with.
    pub fn follow_scenario(
        &self,
        number: u64,
        each_step: impl FnMut(&Rig, &[Occurrence]) -> Result<(), StudyError>,
    ) -> Result<ScenarioRecord, StudyError> {
        self.follow(&self.scenario(number)?, self.steps(), each_step)
    }

    /// Runs any scenario for this many steps and shows `each_step` the rig after every step, with what
    /// happened in it.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made, or what `each_step` fails with.
    pub fn follow(
        &self,
        scenario: &Scenario,
        steps: u64,
        mut each_step: impl FnMut(&Rig, &[Occurrence]) -> Result<(), StudyError>,
    ) -> Result<ScenarioRecord, StudyError> {
        let mut rig = self.rig(scenario.seed, scenario.schedule())?;
        let mut watch = Watch::new(&self.structure, scenario, self.parameters.gages.noise_strain);
        let occurrences = go_through(&mut rig, steps, |rig, latest| {
            watch.follow(rig);
            each_step(rig, latest)
        })?;
        Ok(watch.finish(scenario, &rig, &occurrences, steps))
    }

    /// Runs a nominal run.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made.
    pub fn run_nominal(&self, number: u64) -> Result<NominalRecord, StudyError> {
        self.follow_nominal(number, |_, _| Ok(()))
    }

    /// Runs a nominal run and shows `each_step` the rig after every step, with what happened in it.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made, or what `each_step` fails with.
    pub fn follow_nominal(
        &self,
        number: u64,
        mut each_step: impl FnMut(&Rig, &[Occurrence]) -> Result<(), StudyError>,
    ) -> Result<NominalRecord, StudyError> {
        let seed = nominal_seed(self.seed, number);
        let mut rig = self.rig(seed, Schedule::default())?;
        let mut closest = ClosestSoFar::default();
        let occurrences = go_through(&mut rig, self.nominal_steps(), |rig, latest| {
            closest.follow(rig);
            each_step(rig, latest)
        })?;
        Ok(NominalRecord::of(number, seed, &rig, &occurrences, &closest))
    }
}

/// Goes through the steps of a run; returns all that happened.
fn go_through(
    rig: &mut Rig,
    steps: u64,
    mut each_step: impl FnMut(&Rig, &[Occurrence]) -> Result<(), StudyError>,
) -> Result<Vec<Occurrence>, StudyError> {
    let mut all = Vec::new();
    for _ in 0..steps {
        rig.step()?;
        let latest = rig.take_occurrences();
        each_step(rig, &latest)?;
        all.extend(latest);
    }
    Ok(all)
}
