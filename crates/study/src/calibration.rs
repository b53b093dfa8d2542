//! Thresholds from nominal runs: the largest divergence that a disturbed but healthy structure gives,
//! times a margin (section 4.3 of the paper).

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use diagnosis::{Diagnoser, ModuleSetup, Phase};
use plant::{Mismatch, Plant, PlantParameters};
use truss::Structure;
use truss::ids::RunId;

use crate::error::StudyError;
use crate::rig::{Rig, RigError};
use crate::schedule::Schedule;

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
    /// By how much each run's plant differs from what is believed of it; 0 for not at all.
    pub mismatch: f64,
    /// How many run at a time.
    pub jobs: usize,
}

/// The largest divergences seen, of every channel of every module.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    /// One list a module: actuators, then gages.
    pub largest: Vec<Vec<f64>>,
    /// Steps at which every channel was watched, summed over the runs.
    pub watched_steps: u64,
}

impl Calibration {
    /// Takes the divergences of another run into account. The order does not matter.
    pub fn merge(&mut self, other: &Calibration) {
        self.watched_steps += other.watched_steps;
        self.largest.resize(self.largest.len().max(other.largest.len()), Vec::new());
        for (mine, theirs) in self.largest.iter_mut().zip(&other.largest) {
            mine.resize(mine.len().max(theirs.len()), 0.0);
            for (a, b) in mine.iter_mut().zip(theirs) {
                *a = a.max(*b);
            }
        }
    }
}

impl NominalRuns {
    /// Makes the runs, several at a time, and returns the largest divergences. `done` is told of every
    /// run that is over. The result does not depend on the number of jobs.
    ///
    /// # Errors
    /// A plant or a diagnoser that cannot be made.
    pub fn calibrate(
        &self,
        believed: &Structure,
        parameters: &PlantParameters,
        setups: &[ModuleSetup],
        done: &(dyn Fn() + Sync),
    ) -> Result<Calibration, StudyError> {
        let next = AtomicU64::new(0);
        let result = Mutex::new(Ok(Calibration::default()));
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.max(1) {
                scope.spawn(|| {
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= self.runs {
                            break;
                        }
                        let seed = self.first_seed.wrapping_add(number);
                        let run = self.largest_divergences(believed, parameters, setups, seed);
                        done();
                        note(&result, run);
                    }
                });
            }
        });
        result.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn largest_divergences(
        &self,
        believed: &Structure,
        parameters: &PlantParameters,
        setups: &[ModuleSetup],
        seed: u64,
    ) -> Result<Calibration, StudyError> {
        let plant = plant(believed, parameters, self.mismatch, seed)?;
        let mut setups = setups.to_vec();
        setups.iter_mut().for_each(|setup| setup.thresholds.fill(OUT_OF_REACH));
        let mut rig = Rig::new(plant, setups, Schedule::default(), RunId(seed))?;
        Ok(watch(&mut rig, self.steps)?)
    }
}

/// The plant of a run: as believed, or differing from it by up to `mismatch`.
///
/// # Errors
/// A mismatch or parameters out of range, or a structure without a model.
pub fn plant(
    believed: &Structure,
    parameters: &PlantParameters,
    mismatch: f64,
    seed: u64,
) -> Result<Plant, StudyError> {
    if mismatch == 0.0 {
        return Ok(Plant::new(believed, parameters, seed)?);
    }
    let drawn = Mismatch::draw(believed, parameters, mismatch, seed)?;
    let truth = drawn.structure(believed);
    Ok(Plant::with_believed(&truth, believed, &drawn.parameters, parameters, seed)?)
}

fn note(result: &Mutex<Result<Calibration, StudyError>>, run: Result<Calibration, StudyError>) {
    let mut result = result.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    match (&mut *result, run) {
        (Ok(all), Ok(run)) => all.merge(&run),
        (Ok(_), Err(error)) => *result = Err(error),
        (Err(_), _) => {}
    }
}

/// The largest divergences of one run from the moment that every channel is watched.
fn watch(rig: &mut Rig, steps: u64) -> Result<Calibration, RigError> {
    let channels = |d: &Diagnoser| vec![0.0_f64; d.components().len()];
    let mut largest: Vec<_> = rig.diagnosers().iter().map(channels).collect();
    let mut watched_steps = 0;
    for _ in 0..steps {
        rig.step()?;
        let in_service = |d: &Diagnoser| matches!(d.phase(), Phase::InService { .. });
        if !rig.diagnosers().iter().all(in_service) {
            continue;
        }
        watched_steps += 1;
        for (diagnoser, largest) in rig.diagnosers().iter().zip(&mut largest) {
            for (evidence, largest) in diagnoser.evidence().iter().zip(largest) {
                *largest = evidence.divergence.map_or(*largest, |d| largest.max(d));
            }
        }
    }
    Ok(Calibration { largest, watched_steps })
}
