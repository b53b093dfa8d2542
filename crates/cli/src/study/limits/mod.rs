//! Smallest fault against time, for both detectors, by weather.

mod arguments;
mod report;

use std::sync::atomic::AtomicBool;

use study::conditions::{CommissionedPlant, ConditionCampaign};
use study::figure::limits_figure;
use study::limits::{Detector, LimitCurve, LimitStudy, SizedKind, WeatherLimits};

use super::drawn_plants::commission;
use super::files;
use super::runs::unusable;
use super::weather::Weather;
use crate::failure::Failure;
use crate::progress::Progress;

pub(super) use arguments::Arguments;
use report::Report;

/// Measures the limits and prints them.
pub(super) fn run(arguments: &Arguments, stop: &AtomicBool) -> Result<(), Failure> {
    let Some(weathers) = measure(arguments, stop)? else {
        return Err(Failure::interrupted("interrupted: no limits without all of their runs"));
    };
    Report::of(arguments, &weathers).print(arguments.json)?;
    match &arguments.svg {
        Some(file) => files::write(file, limits_figure(&weathers)),
        None => Ok(()),
    }
}

/// The limits in every weather; `None` if it was stopped.
fn measure(
    arguments: &Arguments,
    stop: &AtomicBool,
) -> Result<Option<Vec<WeatherLimits>>, Failure> {
    let mut weathers = Vec::new();
    for weather in arguments.weather() {
        let campaign = arguments.campaign(weather)?;
        let plants = commission(&campaign, 0..arguments.drawn.plants.get(), arguments.jobs, stop)?;
        let Some(limits) = in_weather(arguments, (weather, &campaign), &plants, stop)? else {
            return Ok(None);
        };
        weathers.push(WeatherLimits { weather: weather.as_str(), limits });
    }
    Ok(Some(weathers))
}

/// The limits of each detector and kind of fault in this weather; `None` if it was stopped.
fn in_weather(
    arguments: &Arguments,
    (weather, campaign): (Weather, &ConditionCampaign),
    plants: &[CommissionedPlant],
    stop: &AtomicBool,
) -> Result<Option<Vec<LimitCurve>>, Failure> {
    let study = LimitStudy { campaign, plants, runs: arguments.runs.get() };
    let each =
        SizedKind::ALL.into_iter().flat_map(|kind| Detector::ALL.map(|detector| (detector, kind)));
    let all: u64 = each.clone().map(|(_, kind)| kind.sizes().len() as u64 * study.runs).sum();
    let progress = Progress::of_runs(weather.as_str(), all);
    let mut limits = Vec::new();
    for (detector, kind) in each {
        let done = || progress.advance();
        let jobs = arguments.jobs.count();
        let curve = study.measure((detector, kind), kind.sizes(), jobs, stop, done);
        match curve.map_err(|error| unusable(&error))? {
            Some(curve) => limits.push(curve),
            None => return Ok(None),
        }
    }
    progress.end();
    Ok(Some(limits))
}
