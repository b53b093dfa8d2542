//! Measuring power: the same runs again and again, with faults of growing size.
//!
//! Sizes count in units of the noise that hides the fault. Run `i` of every size has the same tower,
//! wind and noise, the same component and onset, so that sizes differ by nothing but the size.

use std::sync::atomic::AtomicBool;

use diagnosis::ModuleSetup;
use names::Step;
use names::fault::{Fault, FaultKind};
use plant::PlantParameters;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::campaign::Campaign;
use crate::error::StudyError;
use crate::parallel;
use crate::power::{PowerCurve, PowerPoint};
use crate::record::ScenarioRecord;
use crate::scenario::{Scenario, components_that_can_have, gage_length_m};
use crate::schedule::Injection;
use crate::summary::{Delays, Interval95, share_interval};

/// A fault counts as found if its component is named within this time \[s\].
const FOUND_WITHIN_S: f64 = 1.0;

/// The fault begins this long after every channel is watched, at the earliest and the latest \[s\].
const ONSET_AFTER_S: [f64; 2] = [0.5, 1.0];

/// The share of runs that defines the minimum isolable fault.
const SURELY: f64 = 0.95;

/// A kind of fault whose size is varied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SizedFault {
    /// Offset of a gage, in units of its noise.
    Bias,
    /// Increments of a gage's random walk per millisecond, in units of its noise.
    RandomWalk,
    /// Steady drift of a gage per second, in units of its noise.
    Drift,
    /// Leak of chamber A to the environment. One unit is the area whose leak moves the force, in the
    /// steady state of the force loop at rest, by the noise of the observed force.
    Leakage,
}

impl SizedFault {
    /// All of them.
    pub const ALL: [SizedFault; 4] =
        [SizedFault::Bias, SizedFault::RandomWalk, SizedFault::Drift, SizedFault::Leakage];

    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            SizedFault::Bias => "bias",
            SizedFault::RandomWalk => "random walk",
            SizedFault::Drift => "steady drift",
            SizedFault::Leakage => "external leakage of chamber A",
        }
    }

    /// Unit of the size.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            SizedFault::Bias => "gage noise",
            SizedFault::RandomWalk => "gage noise per ms",
            SizedFault::Drift => "gage noise per s",
            SizedFault::Leakage => "force noise",
        }
    }

    /// The sizes that are tried, ascending.
    #[must_use]
    pub fn sizes(self) -> Vec<f64> {
        // steps of a quarter: fine enough to see where the curve rises
        let from = |first: f64, count: i32| (0..count).map(|i| first * 1.25_f64.powi(i)).collect();
        match self {
            SizedFault::Bias => from(1.0, 14),
            SizedFault::RandomWalk => from(0.1, 14),
            SizedFault::Drift => from(20.0, 20),
            SizedFault::Leakage => from(0.5, 14),
        }
    }

    fn kind(self) -> FaultKind {
        match self {
            SizedFault::Bias => FaultKind::Bias,
            SizedFault::RandomWalk | SizedFault::Drift => FaultKind::RandomWalk,
            SizedFault::Leakage => FaultKind::ExternalLeakageA,
        }
    }

    /// The fault of this size of a gage of this length.
    fn of_size(self, size: f64, length_m: f64, parameters: &PlantParameters) -> Fault {
        let noise_m = size * parameters.gages.noise_strain * length_m;
        match self {
            SizedFault::Bias => Fault::Bias { offset_m: noise_m },
            SizedFault::RandomWalk => Fault::RandomWalk {
                drift_m_per_s: 0.0,
                increment_m: noise_m * (parameters.step_s / 1e-3).sqrt(),
            },
            SizedFault::Drift => Fault::RandomWalk { drift_m_per_s: noise_m, increment_m: 0.0 },
            SizedFault::Leakage => {
                Fault::ExternalLeakageA { area_m2: size * leak_unit_m2(parameters) }
            }
        }
    }
}

/// The leak of chamber A whose flow Q at rest the force loop makes up for at a force error of the
/// noise σ of the observed force: Q = K_P σ, and Q = A √(2 Δp / ρ).
fn leak_unit_m2(parameters: &PlantParameters) -> f64 {
    let h = &parameters.hydraulics;
    let noise_n = h.pressure_noise_pa * h.area_a_m2.hypot(h.area_b_m2);
    let speed = (2.0 * (h.rest_a_pa - h.ambient_pa) / h.oil_density_kg_per_m3).sqrt();
    h.force_gain_m3_per_s_per_n * noise_n / speed
}

/// Measures the power against a kind of fault, with `runs` runs of each size, `jobs` at a time. `done`
/// is called after every run. `None` if it was stopped.
///
/// # Errors
/// A plant or diagnosers that cannot be made.
pub fn measure_power(
    campaign: &Campaign,
    fault: SizedFault,
    runs: u64,
    jobs: usize,
    stop: &AtomicBool,
    mut done: impl FnMut() + Send,
) -> Result<Option<PowerCurve>, StudyError> {
    let sizes = fault.sizes();
    let items: Vec<(usize, u64)> =
        (0..sizes.len()).flat_map(|size| (0..runs).map(move |run| (size, run))).collect();
    let mut delays: Vec<Vec<u64>> = vec![Vec::new(); sizes.len()];
    let mut made = 0;
    let work = |&(size, run): &(usize, u64)| {
        let scenario = scenario(campaign, fault, sizes[size], run)?;
        let steps = scenario.injection.at.0 + within(campaign);
        campaign.follow(&scenario, steps, |_, _| Ok(()))
    };
    let keep = |&(size, _): &(usize, u64), record: ScenarioRecord| {
        delays[size].extend(record.detection_delay().filter(|_| !record.is_false_alarm()));
        made += 1;
        done();
        Ok(())
    };
    parallel::for_each(&items, jobs, stop, work, keep)?;
    if made < items.len() {
        return Ok(None);
    }
    let point = |(size, delays): (f64, Vec<u64>)| point(size, delays, runs, campaign);
    let points: Vec<PowerPoint> = sizes.into_iter().zip(delays).map(point).collect();
    Ok(Some(PowerCurve {
        title: fault.title().to_owned(),
        unit: fault.unit().to_owned(),
        smallest_95: smallest_found(&points),
        points,
    }))
}

/// Steps within which a fault must be found.
fn within(campaign: &Campaign) -> u64 {
    (FOUND_WITHIN_S / campaign.parameters.step_s).round() as u64
}

fn scenario(
    campaign: &Campaign,
    fault: SizedFault,
    size: f64,
    run: u64,
) -> Result<Scenario, StudyError> {
    let Campaign { structure, parameters, .. } = campaign;
    let mut generator = ChaCha8Rng::seed_from_u64(campaign.seed);
    // Neither the scenarios nor the nominal runs of the campaign draw from these streams.
    generator.set_stream((1 << 62) | run);
    let seed = generator.next_u64();
    let [from, to] = ONSET_AFTER_S;
    let after_s = generator.random_range(from..=to);
    let fitting = components_that_can_have(structure, fault.kind());
    let component = (fitting.get(generator.random_range(0..fitting.len().max(1))).cloned())
        .ok_or(StudyError::NothingToBreak)?;
    let fault = fault.of_size(size, gage_length_m(structure, &component), parameters);
    let at = Step(watched_from(&campaign.setups) + (after_s / parameters.step_s).round() as u64);
    Ok(Scenario { number: run, seed, injection: Injection { at, until: None, component, fault } })
}

/// The first step at which every channel is watched.
pub(crate) fn watched_from(setups: &[ModuleSetup]) -> u64 {
    let warm_up = |setup: &ModuleSetup| {
        setup.detection.warm_up_vectors + setup.detection.divergence.window as u64
    };
    setups.iter().map(warm_up).max().unwrap_or(0)
}

fn point(size: f64, delays: Vec<u64>, runs: u64, campaign: &Campaign) -> PowerPoint {
    let found = delays.len() as u64;
    let Interval95(low, high) = share_interval(found, runs);
    let delays = Delays::of(delays.into_iter(), campaign.parameters.step_s);
    let probability = found as f64 / runs.max(1) as f64;
    PowerPoint { size, probability, low, high, median_delay_ms: delays.median }
}

/// The smallest size from which on all sizes are found nearly always.
fn smallest_found(points: &[PowerPoint]) -> Option<f64> {
    let surely = points.iter().rev().take_while(|point| point.probability >= SURELY);
    surely.last().map(|point| point.size)
}
