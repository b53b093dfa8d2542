//! `trusswatch calibrate`: thresholds from data without a fault, simulated or recorded.

mod arguments;
mod columns;
mod recorded;
mod simulated;
mod thresholds;

use std::fs::Permissions;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use daemon::config::{Uncalibrated, load_uncalibrated};
use diagnosis::thresholds::{MadeFor, MeasuredEffects, Provenance, Thresholds};
use study::Calibration;
use tempfile::{Builder, NamedTempFile, PersistError};

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
    /// The simulated loads, in words.
    loads: Option<String>,
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
    let effects = match &arguments.simulation.plant {
        Some(plant) => Some(simulated::effects(plant, &arguments.simulation, &modules, &found)?),
        None => None,
    };
    let mut files = Vec::with_capacity(modules.len());
    for ((module, peaks), found) in modules.iter().zip(&data.calibration.modules).zip(&found) {
        let components = peaks.channels.iter().map(|channel| channel.component.clone());
        let thresholds = Thresholds {
            module: module.setup.module.clone(),
            provenance: data.provenance(rule, peaks.watched_steps),
            made_for: Some(MadeFor {
                loads: data.loads.clone(),
                ..MadeFor::new(&module.setup.structure, module.setup.step_s)
            }),
            effects: effects.clone(),
            detection: module.detection,
            thresholds: components.zip(found.iter().map(|channel| channel.threshold)).collect(),
        };
        files.push(prepare(&module.thresholds, &thresholds)?);
    }
    // A mixture of old and new thresholds is worse than either.
    for (file, module) in files.into_iter().zip(&modules) {
        let unwritable = |error: PersistError| Failure::unwritable(&module.thresholds, error.error);
        file.persist(&module.thresholds).map_err(unwritable)?;
    }
    let mut out = output::stdout();
    for ((module, peaks), found) in modules.iter().zip(&data.calibration.modules).zip(&found) {
        writeln!(out, "{}\n", threshold_table(peaks, found).text(terminal_width()))?;
        writeln!(out, "{}: {} thresholds\n", module.thresholds.display(), found.len())?;
    }
    if let Some(effects) = effects {
        let MeasuredEffects { runs, largest_ratio, margin, root_ratio, latest_ms, effect_ms } =
            effects;
        writeln!(
            out,
            "effects of {runs} faults: at most {largest_ratio} times a threshold within the tie, so that from \
             {root_ratio} on ({margin} times as much) a change is a root cause; at most {latest_ms} ms from a fault's own \
             change, so that it explains for {effect_ms} ms"
        )?;
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

/// Writes a file beside the one that it is to replace.
fn prepare(file: &Path, thresholds: &Thresholds) -> Result<NamedTempFile, Failure> {
    let text = toml::to_string(thresholds).map_err(|error| Failure::runtime(error.to_string()))?;
    let folder = file.parent().filter(|folder| *folder != Path::new(""));
    let prepared = Builder::new()
        .permissions(Permissions::from_mode(0o644))
        .tempfile_in(folder.unwrap_or(Path::new(".")))
        .and_then(|mut prepared| prepared.write_all(text.as_bytes()).map(|()| prepared));
    prepared.map_err(|error| Failure::unwritable(file, error))
}
