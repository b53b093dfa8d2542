//! `trusswatch calibrate`: thresholds from data without a fault, simulated or recorded.

mod arguments;
mod columns;
mod recorded;
mod simulated;
mod thresholds;

use std::io::Write;
use std::path::Path;

use daemon::config::{Uncalibrated, load_uncalibrated};
use diagnosis::thresholds::{Provenance, Thresholds};
use study::Calibration;

use crate::failure::Failure;
use crate::output;
use crate::table::terminal_width;

pub(crate) use arguments::Arguments;
use arguments::ThresholdRule;
use thresholds::{round, threshold_table};

/// Divergences without a fault, and where they come from.
#[derive(Debug)]
struct NominalData {
    calibration: Calibration,
    /// Length of a step \[s\].
    step_s: f64,
    /// Of the data; what is made of them is added for each module.
    provenance: Provenance,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let rule = arguments.check()?;
    let modules: Vec<Uncalibrated> =
        arguments.modules.iter().map(|file| load_uncalibrated(file)).collect::<Result<_, _>>()?;
    let data = match &arguments.simulation.plant {
        Some(plant) => simulated::simulate(plant, &arguments.simulation, &modules)?,
        None => recorded::read(&arguments.recorded, &arguments.table, &modules)?,
    };
    let found = thresholds::thresholds(&data, rule)?;
    let mut out = output::stdout();
    for ((module, peaks), found) in modules.iter().zip(&data.calibration.modules).zip(&found) {
        let components = peaks.channels.iter().map(|channel| channel.component.clone());
        let thresholds = Thresholds {
            module: module.setup.module.clone(),
            provenance: data.provenance(rule, peaks.watched_steps),
            detection: module.detection,
            thresholds: components.zip(found.iter().map(|channel| channel.threshold)).collect(),
        };
        write_file(&module.thresholds, &thresholds)?;
        writeln!(out, "{}\n", threshold_table(peaks, found).text(terminal_width()))?;
        writeln!(out, "{}: {} thresholds\n", module.thresholds.display(), found.len())?;
    }
    Ok(())
}

impl NominalData {
    /// The provenance for a module's thresholds file; `watched_steps` of its data were judged.
    fn provenance(&self, rule: ThresholdRule, watched_steps: u64) -> Provenance {
        let (method, margin, false_alarms_per_hour) = match rule {
            ThresholdRule::Max { margin } => {
                ("largest divergence without a fault, times the margin", margin, None)
            }
            ThresholdRule::Tail { per_hour } => (
                "generalised Pareto tail of the divergence's peaks without a fault, to false_alarms_per_hour",
                1.0,
                Some(per_hour),
            ),
        };
        Provenance {
            method: method.into(),
            hours: round(watched_steps as f64 * self.step_s / 3600.0),
            margin,
            false_alarms_per_hour,
            ..self.provenance.clone()
        }
    }
}

/// Where data come from, before anything was made of them.
fn origin(seeds: Option<String>, recordings: Vec<String>, runs: u64) -> Provenance {
    Provenance {
        method: String::new(),
        seeds,
        recordings,
        runs,
        hours: 0.0,
        margin: 1.0,
        mismatch: None,
        false_alarms_per_hour: None,
        note: None,
    }
}

fn write_file(file: &Path, thresholds: &Thresholds) -> Result<(), Failure> {
    let text = toml::to_string(thresholds).map_err(|error| Failure::runtime(error.to_string()))?;
    std::fs::write(file, text).map_err(|error| Failure::unwritable(file, error))
}
