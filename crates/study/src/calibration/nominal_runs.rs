//! Divergences of simulated runs without a fault.

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

/// Never reached by a divergence.
const OUT_OF_REACH: f64 = f64::MAX;

/// Which runs without a fault are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NominalRuns {
    /// Seed of the first run; the others follow one by one.
    pub first_seed: u64,
    /// How many.
    pub runs: u64,
    /// Length of a run, warm-up included \[steps\].
    pub steps: u64,
    /// By how much each run's plant differs from the nominal model; 0 for no mismatch.
    pub mismatch: f64,
    /// How many run at a time.
    pub jobs: usize,
}

impl NominalRuns {
    /// Makes the runs, several at a time, and returns the largest peaks of all divergences. `done` is
    /// called after every run. The result does not depend on the number of jobs.
    ///
    /// # Errors
    /// A plant or a diagnoser that cannot be made.
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

/// The plant of a run: nominal, or differing from the nominal model by up to `mismatch`.
///
/// # Errors
/// A mismatch or parameters out of range, or a structure without a model.
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

/// The divergences of one run from the moment that every channel of a module is watched.
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
