//! Divergences of simulated runs.

use std::path::Path;

use daemon::config::{PlantFlags, Uncalibrated, load_plant};
use diagnosis::ModuleSetup;
use diagnosis::thresholds::{MeasuredEffects, Provenance};
use study::{EffectRuns, NominalRuns};

use super::arguments::NominalRunFlags;
use super::thresholds::{ChannelThreshold, round};
use super::{NominalData, origin};
use crate::failure::Failure;
use crate::progress::WorkProgress;

/// A change this many times the largest measured effect is not treated as an effect. The divergence grows with the
/// fourth power of a fault's size, so it covers effects one and a half times as large.
const MARGIN: f64 = 4.0;
/// Factor on the time between a fault and its effects, and the least effect time as a share of the interval: late effects
/// are rare, and when a fault leaves the interval the oscillation that followed it leaves a little later.
const TIME_MARGIN: f64 = 2.0;
const LEAST_SHARE: f64 = 0.25;
/// What counts as the interval if it grows \[ms\].
const GROWING_MS: f64 = 1e3;
/// Below it a change may as well be chance.
const LEAST_RATIO: f64 = 10.0;
/// Runs with a fault in each component.
const EFFECT_RUNS: u64 = 4;

/// Simulates faults in each component, with the thresholds found.
pub(super) fn effects(
    plant: &Path,
    simulation: &NominalRunFlags,
    modules: &[Uncalibrated],
    found: &[Vec<ChannelThreshold>],
) -> Result<MeasuredEffects, Failure> {
    let plant = load_plant(plant, &PlantFlags::default())?;
    let with_thresholds = |(module, found): (&Uncalibrated, &Vec<ChannelThreshold>)| ModuleSetup {
        thresholds: found.iter().map(|channel| channel.threshold).collect(),
        ..module.setup.clone()
    };
    let setups: Vec<_> = modules.iter().zip(found).map(with_thresholds).collect();
    let runs = EffectRuns {
        first_seed: simulation.first_seed.wrapping_add(simulation.runs),
        runs: EFFECT_RUNS,
        mismatch: simulation.mismatch,
        jobs: simulation.jobs(),
    };
    let progress = WorkProgress::new("measuring effects", "runs", runs.count(&setups));
    let effects =
        runs.measure(&plant.structure, &plant.parameters, &setups, &|| progress.advance());
    drop(progress);
    let effects = effects.map_err(|error| Failure::input(error.to_string()))?;
    let step_ms = 1e3 * plant.parameters.step_s;
    let latest_ms = step_ms * effects.latest_steps as f64;
    let of_interval = |setup: &ModuleSetup| setup.detection.divergence.interval.vectors();
    let vectors = setups.iter().filter_map(of_interval).min();
    let interval_ms = vectors.map_or(GROWING_MS, |vectors| step_ms * vectors as f64);
    let effect_ms = (TIME_MARGIN * latest_ms).min(interval_ms).max(LEAST_SHARE * interval_ms);
    Ok(MeasuredEffects {
        runs: effects.runs,
        largest_ratio: round(effects.largest_ratio),
        margin: MARGIN,
        root_ratio: round((MARGIN * effects.largest_ratio).max(LEAST_RATIO)),
        latest_ms: round(latest_ms),
        effect_ms: round(effect_ms),
    })
}

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
    let progress = WorkProgress::new("calibrating", "runs", simulation.runs);
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
    let loads = Some(plant.parameters.loads_in_words());
    Ok(NominalData { calibration, step_s, provenance, loads })
}
