//! What a campaign leaves in its directory, besides its journal.

use std::fs;
use std::path::Path;

use names::ComponentPath;
use serde::Serialize;
use study::{Diagnosed, NominalRecord, ScenarioRecord};

use super::runs::Runs;
use crate::failure::Failure;

/// A line of `scenarios.csv`, with the parameters of the kinds of fault that campaigns draw.
#[derive(Serialize)]
struct ScenarioRow {
    number: u64,
    seed: u64,
    component: ComponentPath,
    fault: &'static str,
    area_m2: Option<f64>,
    offset_m: Option<f64>,
    increment_m: Option<f64>,
    drift_m_per_s: Option<f64>,
    onset_step: u64,
    base_speed_m_per_s: f64,
    reading_over_noise: Option<f64>,
    exact: bool,
    detected: bool,
    wrong: usize,
    early: bool,
    delay_steps: Option<u64>,
    verdict_delay_steps: Option<u64>,
    changes: u64,
    questions: u64,
    explained: u64,
    diagnosed: String,
}

/// A line of `nominal.csv`.
#[derive(Serialize)]
struct NominalRow {
    number: u64,
    seed: u64,
    base_speed_m_per_s: f64,
    false_alarm: bool,
    closest: Option<ComponentPath>,
    closest_ratio: Option<f64>,
    changes: u64,
    diagnosed: String,
}

/// Writes the tables of runs.
pub(super) fn write_tables(directory: &Path, runs: &Runs) -> Result<(), Failure> {
    write_table(&directory.join("scenarios.csv"), runs.scenarios.iter().map(ScenarioRow::of))?;
    write_table(&directory.join("nominal.csv"), runs.nominal.iter().map(NominalRow::of))
}

/// Writes a file whole or not at all.
pub(super) fn write(file: &Path, content: impl AsRef<[u8]>) -> Result<(), Failure> {
    let beside = file.with_extension("new");
    fs::write(&beside, content)
        .and_then(|()| fs::rename(&beside, file))
        .map_err(|error| Failure::runtime(format!("cannot write `{}`: {error}", file.display())))
}

/// Writes a table, a row of it for each item.
pub(super) fn write_table(
    file: &Path,
    mut rows: impl Iterator<Item = impl Serialize>,
) -> Result<(), Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let cannot = |error: &dyn std::fmt::Display| {
        Failure::runtime(format!("cannot write `{}`: {error}", file.display()))
    };
    rows.try_for_each(|row| writer.serialize(row)).map_err(|error| cannot(&error))?;
    write(file, writer.into_inner().map_err(|error| cannot(&error))?)
}

impl ScenarioRow {
    fn of(record: &ScenarioRecord) -> Self {
        let parameters = record.fault.parameters();
        let parameter =
            |name| parameters.iter().find(|(of, _)| *of == name).map(|(_, value)| *value);
        Self {
            number: record.number,
            seed: record.seed,
            component: record.component.clone(),
            fault: record.kind().as_str(),
            area_m2: parameter("area_m2"),
            offset_m: parameter("offset_m"),
            increment_m: parameter("increment_m"),
            drift_m_per_s: parameter("drift_m_per_s"),
            onset_step: record.onset.0,
            base_speed_m_per_s: record.base_speed_m_per_s,
            reading_over_noise: record.reading_over_noise,
            exact: record.is_exact(),
            detected: record.is_detected(),
            wrong: record.wrong().count(),
            early: record.is_false_alarm(),
            delay_steps: record.detection_delay(),
            verdict_delay_steps: record.verdict_delay(),
            changes: record.conversation.changes,
            questions: record.conversation.questions,
            explained: record.conversation.explained,
            diagnosed: names(&record.diagnosed),
        }
    }
}

impl NominalRow {
    fn of(record: &NominalRecord) -> Self {
        Self {
            number: record.number,
            seed: record.seed,
            base_speed_m_per_s: record.base_speed_m_per_s,
            false_alarm: record.is_false_alarm(),
            closest: record.closest.as_ref().map(|closest| closest.component.clone()),
            closest_ratio: record.closest.as_ref().map(|closest| closest.ratio),
            changes: record.conversation.changes,
            diagnosed: names(&record.diagnosed),
        }
    }
}

/// `module1/sensor/g5@10804`, one after the other.
fn names(diagnosed: &[Diagnosed]) -> String {
    let named = |d: &Diagnosed| format!("{}@{}", d.component, d.detection);
    diagnosed.iter().map(named).collect::<Vec<_>>().join(" ")
}
