//! Two rules and two actuator residuals, in their four combinations, on the same scenarios.

use std::sync::atomic::AtomicBool;

use diagnosis::Rule;
use diagnosis::residual::ActuatorResidual;
use serde::Serialize;
use study::summary::Summary;
use study::{Campaign, NominalRuns};

use super::arguments::RunsArguments;
use super::runs;
use crate::failure::Failure;
use crate::progress::Progress;

/// How thresholds of a residual are made that has none: as the shipped ones were, from fewer runs.
const CALIBRATION_FIRST_SEED: u64 = 1_000_000;
const CALIBRATION_RUNS: u64 = 300;
const CALIBRATION_MISMATCH: f64 = 0.1;
const CALIBRATION_MARGIN: f64 = 2.5;

/// What one combination came to.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Combination {
    pub(super) rule: Rule,
    pub(super) actuator_residual: ActuatorResidual,
    #[serde(flatten)]
    pub(super) summary: Summary,
}

/// What all four came to.
#[derive(Debug, Serialize)]
pub(super) struct Comparison<'a> {
    pub(super) combinations: &'a [Combination],
}

/// Tries the four combinations on the scenarios that the arguments ask for.
pub(super) fn combinations(
    arguments: &RunsArguments,
    campaign: &Campaign,
    stop: &AtomicBool,
) -> Result<Vec<Combination>, Failure> {
    let mut combinations = Vec::new();
    for actuator_residual in [ActuatorResidual::Demand, ActuatorResidual::Tracking] {
        let watched = watched_by(actuator_residual, arguments, campaign)?;
        for rule in [Rule::Paper, Rule::FirstChange] {
            let mut judged = watched.clone();
            judged.setups.iter_mut().for_each(|setup| setup.isolation.rule = rule);
            let runs = runs::make(arguments, &judged, None, stop)?;
            if !runs.complete {
                return Err(Failure::interrupted("interrupted"));
            }
            let step_s = campaign.parameters.step_s;
            let summary = Summary::of(&runs.scenarios, &runs.nominal, step_s);
            combinations.push(Combination { rule, actuator_residual, summary });
        }
    }
    Ok(combinations)
}

/// The campaign with its actuators watched by this residual, with thresholds made for it.
fn watched_by(
    residual: ActuatorResidual,
    arguments: &RunsArguments,
    campaign: &Campaign,
) -> Result<Campaign, Failure> {
    let mut campaign = campaign.clone();
    if campaign.setups.iter().all(|setup| setup.detection.actuator_residual == residual) {
        return Ok(campaign);
    }
    campaign.setups.iter_mut().for_each(|setup| setup.detection.actuator_residual = residual);
    let runs = NominalRuns {
        first_seed: CALIBRATION_FIRST_SEED,
        runs: CALIBRATION_RUNS,
        steps: campaign.steps(),
        mismatch: CALIBRATION_MISMATCH,
        jobs: arguments.jobs.count(),
    };
    let progress = Progress::of_runs("calibration", runs.runs);
    let done = || progress.advance();
    let Campaign { structure, parameters, setups, .. } = &campaign;
    let calibration = runs
        .calibrate(structure, parameters, setups, &done)
        .map_err(|error| runs::unusable(&error))?;
    progress.end();
    for (setup, module) in campaign.setups.iter_mut().zip(&calibration.modules) {
        let largest = module.channels.iter().map(|channel| channel.peaks.largest());
        setup.thresholds = largest.map(|d| d * CALIBRATION_MARGIN).collect();
    }
    Ok(campaign)
}
