//! Divergences of simulated runs.

use std::path::Path;

use daemon::config::{PlantFlags, Uncalibrated, load_plant};
use diagnosis::thresholds::Provenance;
use study::NominalRuns;

use super::arguments::NominalRunFlags;
use super::{NominalData, origin};
use crate::failure::Failure;
use crate::progress::WorkProgress;

pub(super) fn simulate(
    plant: &Path,
    simulation: &NominalRunFlags,
    modules: &[Uncalibrated],
) -> Result<NominalData, Failure> {
    let plant = load_plant(plant, &PlantFlags::default())?;
    let step_s = plant.parameters.step_s;
    let runs = NominalRuns {
        first_seed: simulation.first_seed,
        runs: simulation.runs,
        steps: (simulation.seconds / step_s).round() as u64,
        mismatch: simulation.mismatch,
        jobs: simulation.jobs(),
    };
    let setups: Vec<_> = modules.iter().map(|module| module.setup.clone()).collect();
    let progress = WorkProgress::of_runs("calibrating", simulation.runs);
    let calibration =
        runs.calibrate(&plant.structure, &plant.parameters, &setups, &|| progress.advance());
    drop(progress);
    let calibration = calibration.map_err(|error| Failure::input(error.to_string()))?;
    if calibration.watched_steps() == 0 {
        let message = format!(
            "a run of {} s ends before every channel is watched; use longer runs",
            simulation.seconds
        );
        return Err(Failure::usage(message));
    }
    let last_seed = simulation.first_seed.saturating_add(simulation.runs.saturating_sub(1));
    let seeds = format!("{}..={last_seed}", simulation.first_seed);
    let mismatch = Some(simulation.mismatch).filter(|mismatch| *mismatch > 0.0);
    let provenance = Provenance { mismatch, ..origin(Some(seeds), Vec::new(), simulation.runs) };
    Ok(NominalData { calibration, step_s, provenance })
}
