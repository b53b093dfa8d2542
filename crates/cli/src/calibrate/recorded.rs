//! Divergences of recorded residuals.

use std::path::PathBuf;

use daemon::config::Uncalibrated;
use study::{Calibration, ResidualRecording};
use vocabulary::ComponentPath;

use super::columns::ChannelColumns;
use super::{NominalData, origin};
use crate::export::{NamedTable, RecordedTables, is_recording, open_csv};
use crate::failure::Failure;
use tables::{CsvRows, TableFlags};

pub(super) fn read(
    files: &[PathBuf],
    flags: &TableFlags,
    modules: &[Uncalibrated],
) -> Result<NominalData, Failure> {
    let step_s = common_step(modules)?;
    let mut recordings = modules
        .iter()
        .map(|module| ResidualRecording::new(&module.setup))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|error| Failure::input(error.to_string()))?;
    let channels: Vec<Vec<ComponentPath>> = (modules.iter().zip(&recordings))
        .map(|(module, recording)| paths(module, recording))
        .collect();
    let (recorded, tables): (Vec<PathBuf>, Vec<PathBuf>) =
        files.iter().cloned().partition(|file| is_recording(file));
    let mut count = tables.len();
    for file in &tables {
        read_table(open_csv(file)?, flags, &channels, &mut recordings)?;
    }
    if !recorded.is_empty() {
        let setups: Vec<_> = modules.iter().map(|module| &module.setup).collect();
        let recorded = RecordedTables::read(&recorded, &setups)?;
        for run in recorded.runs(flags.run)? {
            count += setups.len();
            for setup in &setups {
                let table = recorded.residuals(&[setup], run)?;
                read_table(table, flags, &channels, &mut recordings)?;
            }
        }
    }
    let calibration =
        Calibration { modules: recordings.into_iter().map(ResidualRecording::finish).collect() };
    check_watched(&calibration)?;
    let names = files.iter().map(|file| file.display().to_string()).collect();
    let provenance = origin(None, names, count as u64);
    Ok(NominalData { calibration, step_s, provenance, loads: None })
}

fn common_step(modules: &[Uncalibrated]) -> Result<f64, Failure> {
    let first = modules.first().map_or(f64::NAN, |module| module.setup.step_s);
    for Uncalibrated { setup, .. } in modules {
        if setup.step_s != first {
            return Err(Failure::input(format!(
                "module `{}` has steps of {} s, others of {first} s; calibrate them apart",
                setup.module, setup.step_s
            )));
        }
    }
    Ok(first)
}

fn paths(module: &Uncalibrated, recording: &ResidualRecording) -> Vec<ComponentPath> {
    let path = |component: &vocabulary::Component| ComponentPath {
        module: module.setup.module.clone(),
        component: component.clone(),
    };
    recording.components().iter().map(path).collect()
}

fn read_table(
    (input, name): NamedTable,
    flags: &TableFlags,
    channels: &[Vec<ComponentPath>],
    recordings: &mut [ResidualRecording],
) -> Result<(), Failure> {
    let mut columns = ChannelColumns::default();
    let mut rows = CsvRows::open(input, name.clone(), flags, |header| {
        columns = ChannelColumns::find(header, channels)?;
        Ok(Some(columns.names()))
    })?;
    while let Some(row) = rows.next_row()? {
        if let Some(problem) = row.problem {
            if !flags.skip_bad {
                return Err(Failure::input(format!("{name}, {problem}")));
            }
        } else {
            let taken = columns.take(row.step, row.values, recordings);
            taken.map_err(|wrong| Failure::input(format!("{name}: {wrong}")))?;
        }
    }
    rows.print_remarks();
    recordings.iter_mut().for_each(ResidualRecording::end_run);
    Ok(())
}

fn check_watched(calibration: &Calibration) -> Result<(), Failure> {
    let unwatched = calibration.modules.iter().find(|module| module.watched_steps == 0);
    unwatched.map_or(Ok(()), |module| {
        Err(Failure::input(format!(
            "the recordings of module `{}` end before every channel is watched; record for longer, and give residuals at \
             every step: `trusswatch export --residuals`",
            module.module
        )))
    })
}
