//! A module to try things on: the lower one of the shipped small mast.

use std::sync::LazyLock;

use diagnosis::{Measurements, ModuleSetup};
use vocabulary::{RunId, Step};

use crate::workbench::shipped_module;

/// Its setup.
pub(super) fn lower() -> ModuleSetup {
    static LOWER: LazyLock<ModuleSetup> = LazyLock::new(shipped_module);
    LOWER.clone()
}

/// Samples of it, in which one gage jumps.
pub(super) fn samples(run: RunId, from: Step, count: u64) -> impl Iterator<Item = Measurements> {
    samples_of((2, 3), run, from, count)
}

/// Samples of a module with these numbers of actuators and gages, in which one gage jumps.
pub(super) fn samples_of(
    (actuators, gages): (usize, usize),
    run: RunId,
    from: Step,
    count: u64,
) -> impl Iterator<Item = Measurements> {
    (0..count).map(move |index| {
        let wobble = (index as f64 * 0.7).sin();
        let jump = if index > count / 2 { 1e-3 } else { 0.0 };
        let mut elongations_m = vec![1e-6 * wobble; gages];
        elongations_m.iter_mut().take(1).for_each(|elongation| *elongation += jump);
        Measurements {
            run,
            step: from.plus(index),
            demands_n: vec![100.0 * wobble; actuators],
            pressures_pa: vec![[70e5 + 1e3 * wobble, 98.6e5]; actuators],
            elongations_m,
        }
    })
}
