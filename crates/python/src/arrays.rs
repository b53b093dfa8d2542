//! Arguments as numbers, and numbers as arrays.

use std::fmt::Display;

use numpy::{
    Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyString;

/// A `ValueError` with the program's message.
pub(crate) fn value_error(problem: impl Display) -> PyErr {
    PyValueError::new_err(problem.to_string())
}

/// A whole number from 0 on; a negative one is a `ValueError` as well.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Count(pub(crate) u64);

impl FromPyObject<'_, '_> for Count {
    type Error = PyErr;

    fn extract(number: Borrowed<'_, '_, PyAny>) -> PyResult<Self> {
        let index = number
            .call_method0("__index__")
            .map_err(|_| PyTypeError::new_err("expected a whole number"))?;
        index.extract().map(Count).map_err(|_| {
            value_error(format!("expected a whole number from 0 to 2^64 - 1, not {index}"))
        })
    }
}

impl Count {
    pub(crate) fn size(self) -> usize {
        usize::try_from(self.0).unwrap_or(usize::MAX)
    }
}

/// A number for all channels, or one for each.
#[derive(Debug, Clone, FromPyObject)]
pub(crate) enum PerChannel {
    One(f64),
    Each(Vec<f64>),
}

impl PerChannel {
    /// How many channels there are, if it says so.
    pub(crate) fn count(&self) -> Option<usize> {
        match self {
            Self::One(_) => None,
            Self::Each(each) => Some(each.len()),
        }
    }

    pub(crate) fn of(&self, channels: usize, name: &str) -> PyResult<Vec<f64>> {
        match self {
            Self::One(one) => Ok(vec![*one; channels]),
            Self::Each(each) if each.len() == channels => Ok(each.clone()),
            Self::Each(each) => {
                let found = each.len();
                Err(value_error(format!("{name} has {found} values for {channels} channels")))
            }
        }
    }
}

/// An array as it is or converted: float64, row by row, the rows of this shape.
pub(crate) fn rows<'py>(
    array: &Bound<'py, PyAny>,
    shape: &[usize],
    name: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let numpy = array.py().import("numpy")?;
    let float = numpy.getattr("float64")?;
    let array = numpy.call_method1("require", (array, float, "CA"))?;
    let found: PyReadonlyArrayDyn<'py, f64> = array.extract()?;
    match found.shape().split_first() {
        Some((_, rest)) if rest == shape => Ok(found),
        _ => {
            let expected: String = shape.iter().map(|length| format!(", {length}")).collect();
            let shape = array.getattr("shape")?;
            Err(value_error(format!("{name} has the shape {shape}; use (steps{expected})")))
        }
    }
}

/// Values row by row as an array.
pub(crate) fn matrix<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    columns: usize,
) -> PyResult<Py<PyArray2<T>>> {
    let rows = values.len().checked_div(columns).unwrap_or(0);
    Ok(PyArray1::from_vec(py, values).reshape([rows, columns])?.unbind())
}

/// Pairs of values, so many a row, as an array.
pub(crate) fn pairs(
    py: Python<'_>,
    values: Vec<f64>,
    columns: usize,
) -> PyResult<Py<PyArray3<f64>>> {
    let rows = values.len().checked_div(2 * columns).unwrap_or(0);
    Ok(PyArray1::from_vec(py, values).reshape([rows, columns, 2])?.unbind())
}

/// What JSON says as Python's own values.
pub(crate) fn from_json<'py>(
    py: Python<'py>,
    document: &impl serde::Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(document).map_err(value_error)?;
    py.import("json")?.call_method1("loads", (PyString::new(py, &text),))
}
