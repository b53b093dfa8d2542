//! Measures how large the effects of faults are, and how late they appear.
//!
//! A fault moves other components: a hard-over through the structure, a gage through the controller. Both depend on
//! the structure, so the ratio that no effect exceeds, and the time after which no effect appears, are measured
//! like thresholds: on plants that differ from the nominal model, with a fault in each component.

use std::sync::atomic::AtomicBool;

use diagnosis::ModuleSetup;
use plant::PlantParameters;
use serde::{Deserialize, Serialize};
use truss::Structure;
use vocabulary::{Change, Component, ComponentPath, RunId, Step, fault::Fault};

use super::plant;
use crate::error::StudyError;
use crate::parallel;
use crate::rig::{Rig, TimedFault};
use crate::system::gage_length_m;

/// The bias of a gage \[m/m\]: far above what is isolated, and what moves a controller.
const BIAS_STRAIN: f64 = 100e-6;
/// A run begins with as much of its interval again, so that its start has passed.
const BEFORE: f64 = 1.25;

/// Runs with one fault each, on plants of their own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectRuns {
    /// Seed of the first run; the others have successive seeds.
    pub first_seed: u64,
    /// Runs of each component.
    pub runs: u64,
    /// The mismatch between each run's plant and the nominal model; 0 for none.
    pub mismatch: f64,
    /// The number of parallel runs.
    pub jobs: usize,
}

/// The largest effects of faults on other components.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Effects {
    /// Runs.
    pub runs: u64,
    /// Largest ratio of an effect to its threshold within the tie.
    pub largest_ratio: f64,
    /// Longest time between a fault's own change, as it enters the interval or leaves it, and an effect \[steps\].
    pub latest_steps: u64,
}

impl EffectRuns {
    /// How many runs there are.
    #[must_use]
    pub fn count(&self, setups: &[ModuleSetup]) -> u64 {
        self.runs * setups.iter().map(|setup| setup.components().len() as u64).sum::<u64>()
    }

    /// Simulates the runs in parallel; the thresholds of `setups` are those of the structure. `done` is called after every
    /// run. The result does not depend on the number of jobs.
    ///
    /// # Errors
    /// A plant or a diagnoser cannot be created.
    pub fn measure(
        &self,
        nominal: &Structure,
        parameters: &PlantParameters,
        setups: &[ModuleSetup],
        done: &(dyn Fn() + Sync),
    ) -> Result<Effects, StudyError> {
        let mut setups = setups.to_vec();
        setups.iter_mut().for_each(|setup| setup.isolation.root_ratio = f64::INFINITY);
        let components = setups.iter().flat_map(|setup| {
            let path = |component| ComponentPath { module: setup.module.clone(), component };
            setup.components().into_iter().map(path)
        });
        let components: Vec<ComponentPath> = components.collect();
        let runs: Vec<(u64, &ComponentPath)> = (0..self.runs)
            .flat_map(|_| &components)
            .enumerate()
            .map(|(n, path)| (n as u64, path))
            .collect();
        let mut all = Effects::default();
        let one = |(number, component): &(u64, &ComponentPath)| {
            let seed = self.first_seed.wrapping_add(*number);
            self.one_run(nominal, parameters, &setups, component, seed)
        };
        parallel::for_each(&runs, self.jobs, &AtomicBool::new(false), one, |_, run: Effects| {
            all.runs += run.runs;
            all.largest_ratio = all.largest_ratio.max(run.largest_ratio);
            all.latest_steps = all.latest_steps.max(run.latest_steps);
            done();
            Ok(())
        })?;
        Ok(all)
    }

    fn one_run(
        &self,
        nominal: &Structure,
        parameters: &PlantParameters,
        setups: &[ModuleSetup],
        faulty: &ComponentPath,
        seed: u64,
    ) -> Result<Effects, StudyError> {
        let sign = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
        let fault = match &faulty.component {
            Component::Actuator(_) => Fault::HardOver {},
            Component::Sensor(_) => {
                Fault::Bias { offset_m: sign * BIAS_STRAIN * gage_length_m(nominal, faulty) }
            }
        };
        let warm_up = setups.iter().map(|setup| setup.detection.warm_up_vectors).max().unwrap_or(0);
        let at = Step((BEFORE * warm_up as f64) as u64);
        let divergence = setups.first().map(|setup| setup.detection.divergence);
        let vectors = divergence.and_then(|divergence| divergence.interval.vectors());
        let interval = vectors.map_or(warm_up, |vectors| vectors as u64);
        let spread = divergence.map_or(0, |known| (known.window + known.lag) as u64);
        let faults = vec![TimedFault { at, until: None, component: faulty.clone(), fault }];
        let plant = plant(nominal, parameters, self.mismatch, seed)?;
        let mut rig = Rig::new(plant, setups.to_vec(), faults, RunId(seed))?;
        // The fault enters the interval, and leaves it.
        rig.run(at.0 + interval + 3 * interval / 4)?;
        Ok(effects(&rig, faulty, at.0, interval, spread))
    }
}

/// The effects of a fault at this step, as it enters the interval and as it leaves it.
fn effects(rig: &Rig, faulty: &ComponentPath, at: u64, interval: u64, spread: u64) -> Effects {
    let half = at + interval / 2;
    let since = rig.settled_changes().filter(|(_, change)| change.step.0 >= at);
    let (own, others): (Vec<_>, Vec<_>) = since.partition(|(path, _)| path == faulty);
    let ended =
        |(_, change): &(ComponentPath, &Change)| change.until.map_or(u64::MAX, |step| step.0);
    let entered = own.iter().filter(|(_, change)| change.step.0 < half).map(ended).max();
    let left = own.iter().map(ended).max();
    let mut found = Effects { runs: 1, ..Effects::default() };
    for (_, change) in others {
        found.largest_ratio = found.largest_ratio.max(change.ratio);
        let (Some(entered), Some(left)) = (entered, left) else { continue };
        let onset = change.onset.0;
        let late = if onset < half {
            onset.saturating_sub(entered)
        } else {
            let late = onset.saturating_sub(left.max(entered.saturating_add(interval + spread)));
            late.max((at + interval).saturating_sub(onset).min(onset.saturating_sub(entered)))
        };
        found.latest_steps = found.latest_steps.max(late);
    }
    found
}
