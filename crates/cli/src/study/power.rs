//! How likely faults are found, by their size.

use std::sync::atomic::AtomicBool;

use study::{Campaign, PowerCurve, SizedFault, measure_power};

use super::arguments::Arguments;
use super::runs::unusable;
use crate::failure::Failure;
use crate::progress::Progress;

/// Measures the power against every kind of fault that has a size; `None` if it was stopped.
pub(super) fn measure(
    arguments: &Arguments,
    campaign: &Campaign,
    runs: u64,
    stop: &AtomicBool,
) -> Result<Option<Vec<PowerCurve>>, Failure> {
    if runs == 0 {
        return Err(Failure::usage("`--power` is 0; use at least 1 run for each size"));
    }
    let all: u64 = SizedFault::ALL.iter().map(|fault| fault.sizes().len() as u64 * runs).sum();
    let progress = Progress::of_runs("power", all);
    let mut curves = Vec::new();
    for fault in SizedFault::ALL {
        let done = || progress.advance();
        let curve = measure_power(campaign, fault, runs, arguments.jobs(), stop, done);
        match curve.map_err(|error| unusable(&error))? {
            Some(curve) => curves.push(curve),
            None => return Ok(None),
        }
    }
    progress.end();
    Ok(Some(curves))
}
