//! The package `trusswatch` for Python: arrays of NumPy in; divergences, verdicts and samples out.
//!
//! Nothing is computed here. Each class holds the value that the programs hold, so that its results are the same bits.
//! Whatever cannot be used is a `ValueError` with the program's message.

mod arrays;
mod detector;
mod files;
mod learned;
mod recordings;
mod structure;

use pyo3::prelude::*;

/// The compiled part of the package.
#[pymodule]
mod _trusswatch {
    #[pymodule_export]
    use super::detector::{Detector, Readings};
    #[pymodule_export]
    use super::files::ConfiguredModule;
    #[pymodule_export]
    use super::learned::{Judge, Learned, learn};
    #[pymodule_export]
    use super::recordings::read_recording;
    #[pymodule_export]
    use super::structure::{Diagnosis, ModuleGroup, PlantModel, Scenario, Study};
}
