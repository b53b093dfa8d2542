//! How likely faults are isolated, by their size.

use std::io::{self, Write};
use std::sync::atomic::AtomicBool;

use serde::Serialize;
use study::figure::power_figure;
use study::{Campaign, PowerCurve, SizedFault, measure_power};

use super::arguments::PowerArguments;
use super::runs::unusable;
use super::{files, preset, tables};
use crate::failure::Failure;
use crate::progress::Progress;
use crate::table::terminal_width;
use crate::versioned;

/// What was asked for and what came of it.
#[derive(Serialize)]
struct PowerDocument<'a> {
    preset: &'a str,
    seed: u64,
    mismatch: f64,
    runs: u64,
    power: &'a [PowerCurve],
}

/// Measures the power and prints it.
pub(super) fn run(
    arguments: &PowerArguments,
    campaign: &Campaign,
    stop: &AtomicBool,
) -> Result<(), Failure> {
    let Some(curves) = measure(arguments, campaign, stop)? else {
        return Err(Failure::interrupted("interrupted: no power without all of its runs"));
    };
    let mut out = io::stdout().lock();
    if arguments.json {
        let preset = preset::name(&arguments.campaign);
        let (seed, mismatch) = (campaign.seed, campaign.mismatch);
        let runs = arguments.runs.get();
        let document = PowerDocument { preset, seed, mismatch, runs, power: &curves };
        write!(out, "{}", versioned::text(&document)?)?;
    } else {
        tables::write(&tables::power(&curves), terminal_width(), &mut out)?;
    }
    out.flush()?;
    match &arguments.svg {
        Some(file) => files::write(file, power_figure(&curves)),
        None => Ok(()),
    }
}

/// The power against every kind of fault that has a size; `None` if it was stopped.
fn measure(
    arguments: &PowerArguments,
    campaign: &Campaign,
    stop: &AtomicBool,
) -> Result<Option<Vec<PowerCurve>>, Failure> {
    let runs = arguments.runs.get();
    let all: u64 = SizedFault::ALL.iter().map(|fault| fault.sizes().len() as u64 * runs).sum();
    let progress = Progress::of_runs("power", all);
    let mut curves = Vec::new();
    for fault in SizedFault::ALL {
        let done = || progress.advance();
        let curve = measure_power(campaign, fault, runs, arguments.jobs.count(), stop, done);
        match curve.map_err(|error| unusable(&error))? {
            Some(curve) => curves.push(curve),
            None => return Ok(None),
        }
    }
    progress.end();
    Ok(Some(curves))
}
