//! Two rules and two actuator residuals, in their four combinations, on the same scenarios.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

use diagnosis::Rule;
use diagnosis::residual::ActuatorResidual;
use serde::Serialize;
use study::report::{interval, percent};
use study::scenarios::{ScenarioCampaign, ScenarioSummary};
use study::{Campaign, Done, NominalRuns, System};

use super::arguments::CompareArguments;
use super::conduct;
use crate::failure::Failure;
use crate::output;
use crate::progress::WorkProgress;
use crate::table::{TextTable, table};

/// How thresholds of a residual are made that has none: as the shipped ones were, from fewer runs.
const CALIBRATION_FIRST_SEED: u64 = 1_000_000;
const CALIBRATION_RUNS: u64 = 300;
const CALIBRATION_MISMATCH: f64 = 0.1;
const CALIBRATION_MARGIN: f64 = 2.5;

/// What one combination came to.
#[derive(Debug, Clone, Serialize)]
struct Combination {
    rule: Rule,
    actuator_residual: ActuatorResidual,
    #[serde(flatten)]
    summary: ScenarioSummary,
}

/// Tries the four combinations and prints what they come to.
pub(super) fn run(arguments: &CompareArguments) -> Result<(), Failure> {
    let campaign = arguments.of.campaign()?;
    let (stop, jobs) = (conduct::stop_on_signal()?, arguments.jobs.count());
    let mut combinations = Vec::new();
    for actuator_residual in [ActuatorResidual::Demand, ActuatorResidual::Tracking] {
        let watched = watched_by(actuator_residual, campaign.clone(), jobs)?;
        for rule in [Rule::Paper, Rule::FirstChange] {
            let mut judged = watched.clone();
            judged.system.setups.iter_mut().for_each(|setup| setup.isolation.rule = rule);
            let mut done = Done::default();
            conduct::engine(jobs, &stop).run(&judged, 0..judged.cases(), &mut done, None)?;
            if stop.load(Ordering::Relaxed) {
                return Err(Failure::interrupted("interrupted"));
            }
            let summary = judged.summarize(&done.rows);
            combinations.push(Combination { rule, actuator_residual, summary });
        }
    }
    output::print(&match arguments.json {
        true => output::text(&BTreeMap::from([("combinations", &combinations)]))?,
        false => format!("{}\n", side_by_side(&combinations).text(arguments.width.limit())),
    })
}

/// The campaign with its actuators watched by this residual, with thresholds made for it.
fn watched_by(
    residual: ActuatorResidual,
    mut campaign: ScenarioCampaign,
    jobs: usize,
) -> Result<ScenarioCampaign, Failure> {
    let steps = campaign.system.steps(campaign.ranges.length_s);
    let System { structure, parameters, setups, .. } = &mut campaign.system;
    if setups.iter().all(|setup| setup.detection.actuator_residual == residual) {
        return Ok(campaign);
    }
    setups.iter_mut().for_each(|setup| setup.detection.actuator_residual = residual);
    let runs = NominalRuns {
        first_seed: CALIBRATION_FIRST_SEED,
        runs: CALIBRATION_RUNS,
        steps,
        mismatch: CALIBRATION_MISMATCH,
        jobs,
    };
    let progress = WorkProgress::new("calibration", "runs", runs.runs);
    let calibration = runs.calibrate(structure, parameters, setups, &|| progress.advance())?;
    for (setup, module) in setups.iter_mut().zip(&calibration.modules) {
        let largest = module.channels.iter().map(|channel| channel.peaks.largest());
        setup.thresholds = largest.map(|d| d * CALIBRATION_MARGIN).collect();
    }
    Ok(campaign)
}

fn side_by_side(combinations: &[Combination]) -> TextTable {
    let heading = [
        "rule",
        "actuator residual",
        "exactly isolated",
        "95 %",
        "wrong component",
        "missed",
        "early",
        "accuracy",
        "false alarms",
    ];
    let mut text = table(&heading);
    for Combination { rule, actuator_residual, summary } in combinations {
        let rule = match rule {
            Rule::Paper => "only actuators explain (paper)",
            Rule::FirstChange => "first change names the fault",
        };
        let residual = match actuator_residual {
            ActuatorResidual::Demand => "demand (paper)",
            ActuatorResidual::Tracking => "tracking",
        };
        let (all, nominal) = (&summary.all, &summary.nominal);
        text.add_row(vec![
            rule.to_owned(),
            residual.to_owned(),
            percent(all.exact_share()),
            interval(all.exact_95),
            all.wrong.to_string(),
            all.missed.to_string(),
            all.early.to_string(),
            format!("{:.4}", summary.samples.accuracy),
            format!("{} of {}", nominal.false_alarms, nominal.cases),
        ]);
    }
    text
}
