//! Divergences of simulated runs.

use std::num::NonZeroUsize;
use std::path::Path;

use daemon::config::{PlantFlags, Uncalibrated, load_plant};
use indicatif::{ProgressBar, ProgressStyle};
use study::NominalRuns;

use super::arguments::Simulation;
use super::data::{Data, Origin};
use crate::failure::Failure;

pub(super) fn simulate(
    plant: &Path,
    simulation: &Simulation,
    modules: &[Uncalibrated],
) -> Result<Data, Failure> {
    let plant = load_plant(plant, &PlantFlags::default()).map_err(|errors| {
        Failure::inputs(errors.to_string().lines().map(str::to_owned).collect())
    })?;
    let step_s = plant.parameters.step_s;
    let runs = NominalRuns {
        first_seed: simulation.first_seed,
        runs: simulation.runs,
        steps: (simulation.seconds / step_s).round() as u64,
        mismatch: simulation.mismatch,
        jobs: simulation.jobs.unwrap_or_else(processors).get(),
    };
    let setups: Vec<_> = modules.iter().map(|module| module.setup.clone()).collect();
    let bar = progress_bar(simulation.runs);
    let calibration = runs.calibrate(&plant.structure, &plant.parameters, &setups, &|| bar.inc(1));
    bar.finish_and_clear();
    let calibration = calibration.map_err(|error| Failure::input(error.to_string()))?;
    if calibration.watched_steps() == 0 {
        let message = format!(
            "a run of {} s ends before every channel is watched; use longer runs",
            simulation.seconds
        );
        return Err(Failure::usage(message));
    }
    let origin = Origin::Simulated {
        first_seed: simulation.first_seed,
        runs: simulation.runs,
        mismatch: simulation.mismatch,
    };
    Ok(Data { calibration, step_s, origin })
}

fn processors() -> NonZeroUsize {
    std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

fn progress_bar(runs: u64) -> ProgressBar {
    let template = "{wide_bar} {pos} of {len} runs, {eta} left";
    let style =
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(runs).with_style(style)
}
