//! Recordings (MCAP) as columns.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use recording::Recording;
use replay::{Collection, RunRows, latest_setup};

use crate::arrays::{from_json, value_error};

/// Reads recordings of `trusswatch record` as `trusswatch export` does.
///
/// Parameters
/// ----------
/// files : list of str or path
///     Several are one recording.
/// residuals : bool
///     Give residuals and divergences at every step: the samples go through a diagnoser with the recorded configuration,
///     which starts with the first recorded step of the run. Else they are there where they were published.
/// corrected : bool
///     Give what each gage reads at every step, or should have read from the verdict on it on: the recorded processes are
///     replayed, without their peers' forces.
///
/// Returns
/// -------
/// tables : dict
///     For each module and run, `MODULE-run-RUN`, a dict of columns, arrays of the shape (steps,): step (uint64), time_s [s],
///     published_ns [ns since 1970] (uint64), then by component and signal `module1/actuator/a1/demand_n` [N],
///     `.../pressure_a_pa`, `.../pressure_b_pa` [Pa], `module1/sensor/g5/elongation_m` [m], `.../residual` [N or m],
///     `.../divergence`, with `corrected` `.../corrected_m`, `.../corrected_low_m`, `.../corrected_high_m` (95 % interval)
///     [m]. NaN is missing. `pandas.DataFrame(table)` makes a data frame of one.
/// verdicts : list of dict
///     The messages on transitions, by module and time.
///
/// Raises
/// ------
/// ValueError
///     A file cannot be read whole, or nothing is known of a module's configuration (with `residuals`).
#[pyfunction]
#[pyo3(signature = (files, *, residuals=false, corrected=false))]
pub(crate) fn read_recording<'py>(
    py: Python<'py>,
    files: Vec<PathBuf>,
    residuals: bool,
    corrected: bool,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyAny>)> {
    let mut collection = Collection::default();
    for file in &files {
        let recording = Recording::open(file).map_err(value_error)?;
        for message in recording.messages().map_err(value_error)? {
            let message = message.map_err(value_error)?;
            collection.take(&message.topic, &message.payload);
        }
    }
    let records: Vec<_> = collection.finish().into_iter().map(Arc::new).collect();
    if records.is_empty() {
        return Err(value_error("the recording has no module"));
    }
    let tables = PyDict::new(py);
    let several = records.iter().any(|record| record.structure != records[0].structure);
    for record in &records {
        let module = &record.module;
        if let Some(problem) = &record.unreadable_because {
            let count = record.unreadable;
            return Err(value_error(format!(
                "{count} messages of `{module}` cannot be read: {problem}"
            )));
        }
        let prefix =
            if several { format!("{}-{module}", record.structure) } else { module.to_string() };
        let setup = latest_setup(record);
        for run in record.runs().into_keys() {
            let rows = match (&setup, residuals) {
                (_, false) => Ok(RunRows::published(record, run, setup.as_ref().ok())),
                (Ok(setup), true) => RunRows::replayed(record, run, setup),
                (Err(shortfall), true) => Err(shortfall.clone()),
            };
            let mut rows = rows.map_err(|shortfall| {
                value_error(format!("no residuals of `{module}`: {shortfall}"))
            })?;
            if corrected {
                rows = rows.with_corrected().map_err(|shortfall| {
                    value_error(format!("no corrected readings of `{module}`: {shortfall}"))
                })?;
            }
            tables.set_item(format!("{prefix}-run-{run}"), columns(py, rows)?)?;
        }
    }
    let verdicts: Vec<_> = records.iter().flat_map(|record| &record.transitions).collect();
    Ok((tables, from_json(py, &verdicts)?))
}

fn columns<'py>(py: Python<'py>, rows: RunRows) -> PyResult<Bound<'py, PyDict>> {
    let names = rows.names();
    let (mut steps, mut published, mut columns) = (vec![], vec![], vec![vec![]; names.len()]);
    for row in rows {
        steps.push(row.step);
        published.push(row.published_ns);
        columns.iter_mut().zip(&row.values).for_each(|(column, value)| column.push(*value));
    }
    let table = PyDict::new(py);
    table.set_item("step", PyArray1::from_vec(py, steps))?;
    table.set_item("published_ns", PyArray1::from_vec(py, published))?;
    for (name, column) in names.iter().zip(columns) {
        table.set_item(name, PyArray1::from_vec(py, column))?;
    }
    Ok(table)
}
