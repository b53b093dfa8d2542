//! Divergences of simulated fault-free runs.

use std::sync::atomic::AtomicBool;

use diagnosis::ModuleSetup;
use plant::{Plant, PlantParameters};
use truss::Structure;
use vocabulary::ModulePhase;
use vocabulary::RunId;

use super::Calibration;
use super::collector::Collector;
use crate::commissioning::PlantSite;
use crate::error::StudyError;
use crate::parallel;
use crate::rig::{Rig, RigError};

/// A threshold that no divergence reaches.
const OUT_OF_REACH: f64 = f64::MAX;

/// A set of fault-free runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalRuns {
    /// Seed of the first run; the others have successive seeds.
    pub first_seed: u64,
    /// The number of runs.
    pub runs: u64,
    /// Length of a run, including warm-up \[steps\].
    pub steps: u64,
    /// The mismatch between each run's plant and the nominal model; 0 for none.
    pub mismatch: f64,
    /// The number of parallel runs.
    pub jobs: usize,
}

impl NominalRuns {
    /// Simulates the runs in parallel, and returns the largest peaks of all divergences. `done` is called after every
    /// run. The result does not depend on the number of jobs.
    ///
    /// # Errors
    /// A plant or a diagnoser cannot be created.
    pub fn calibrate(
        &self,
        nominal: &Structure,
        parameters: &PlantParameters,
        setups: &[ModuleSetup],
        done: &(dyn Fn() + Sync),
    ) -> Result<Calibration, StudyError> {
        let seeds: Vec<u64> =
            (0..self.runs).map(|number| self.first_seed.wrapping_add(number)).collect();
        let mut all = Calibration::default();
        parallel::for_each(
            &seeds,
            self.jobs,
            &AtomicBool::new(false),
            |&seed| self.one_run(nominal, parameters, setups, seed),
            |_, run| {
                all.merge(&run);
                done();
                Ok(())
            },
        )?;
        Ok(all)
    }

    fn one_run(
        &self,
        nominal: &Structure,
        parameters: &PlantParameters,
        setups: &[ModuleSetup],
        seed: u64,
    ) -> Result<Calibration, StudyError> {
        let plant = plant(nominal, parameters, self.mismatch, seed)?;
        let mut setups = setups.to_vec();
        setups.iter_mut().for_each(|setup| setup.thresholds.fill(OUT_OF_REACH));
        let mut rig = Rig::new(plant, setups.clone(), Vec::new(), RunId(seed))?;
        Ok(watch(&mut rig, &setups, self.steps)?)
    }
}

/// The plant of a run: nominal, or with a mismatch of up to `mismatch`.
///
/// # Errors
/// The mismatch or a parameter is out of range, or the structure does not yield a valid model.
pub fn plant(
    nominal: &Structure,
    parameters: &PlantParameters,
    mismatch: f64,
    seed: u64,
) -> Result<Plant, StudyError> {
    let site = match mismatch == 0.0 {
        true => PlantSite::nominal(nominal, parameters),
        false => PlantSite::drawn(nominal, parameters, mismatch, seed)?,
    };
    site.plant(seed)
}

/// The divergences of one run from the time at which every channel of a module is watched.
fn watch(rig: &mut Rig, setups: &[ModuleSetup], steps: u64) -> Result<Calibration, RigError> {
    let mut collectors: Vec<Collector> = (setups.iter().zip(rig.diagnosers()))
        .map(|(setup, diagnoser)| Collector::new(setup, diagnoser.components()))
        .collect();
    for _ in 0..steps {
        rig.step()?;
        for (diagnoser, collector) in rig.diagnosers().iter().zip(&mut collectors) {
            if diagnoser.phase() == ModulePhase::InService {
                collector.take(diagnoser.evidence().iter().map(|evidence| evidence.divergence));
            } else {
                collector.skip();
            }
        }
    }
    Ok(Calibration { modules: collectors.into_iter().map(Collector::finish).collect() })
}
