//! No finite series makes a module panic, whatever its gages and cylinders read: detection, comparison, commissioning
//! and identification run on all of them, and every identification that a diagnoser asks for is carried out.

use std::sync::{Arc, LazyLock};

use crate::fixture::{self, Bench, WARM_UP, setup};
use diagnosis::identification::{Excerpt, identify};
use diagnosis::state::{Reference, Snippet, WindowLength, commission};
use diagnosis::{Action, Diagnoser, Event, Measurements, ModuleSetup, Rule};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// The models have settled and the channels are watched.
const SETTLED: u64 = 4000;
/// Noise of a gage as configured \[m\].
const NOISE_M: f64 = 0.9e-6;
const BIAS_M: f64 = 30e-6;

fn alone() -> ModuleSetup {
    ModuleSetup { peers: Vec::new(), ..setup("lower", Rule::FirstChange) }
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// What a signal reads, step by step.
#[derive(Debug, Clone)]
enum Series {
    Constant(f64),
    /// Normal noise of this deviation, rounded to a step of the converter.
    Noise {
        deviation: f64,
        resolution: f64,
    },
    TwoValues([f64; 2]),
    /// This once, then nothing.
    Once(f64),
    Ramp(f64),
    Walk(f64),
    Alternating(f64),
    Missing,
}

impl Series {
    fn value(&self, step: u64, before: f64, random: &mut ChaCha8Rng) -> f64 {
        match self {
            Series::Constant(value) => *value,
            Series::Noise { deviation, resolution } if *resolution > 0.0 => {
                (deviation * normal(random) / resolution).round() * resolution
            }
            Series::Noise { deviation, .. } => deviation * normal(random),
            Series::TwoValues(values) => values[usize::from(random.random::<bool>())],
            Series::Once(value) if step == 0 => *value,
            Series::Once(_) | Series::Missing => f64::NAN,
            Series::Ramp(per_step) => per_step * step as f64,
            Series::Walk(increment) => {
                if before.is_finite() {
                    before + increment * normal(random)
                } else {
                    0.0
                }
            }
            Series::Alternating(value) => {
                if step.is_multiple_of(2) {
                    *value
                } else {
                    -value
                }
            }
        }
    }
}

fn series() -> impl Strategy<Value = Series> {
    // From the smallest number to the largest; usual sizes more often.
    let size = prop_oneof![
        4 => (-9.0..3.0_f64).prop_map(|power| 10_f64.powf(power)),
        1 => (-323.0..308.0_f64).prop_map(|power| 10_f64.powf(power)),
        1 => Just(f64::MAX),
        1 => Just(f64::MIN_POSITIVE),
        1 => Just(0.0),
    ];
    let any = (size, -1.0..1.0_f64, 0_usize..8);
    any.prop_map(|(size, other, which)| match which {
        0 => Series::Constant(size * other),
        1 => Series::Noise { deviation: size.min(1e300), resolution: 0.0 },
        2 => Series::Noise { deviation: size.min(1e300), resolution: 3.0 * other.abs() * size },
        3 => Series::TwoValues([size, size * other]),
        4 => Series::Once(size),
        5 => Series::Ramp(size * other),
        6 => Series::Walk(size.min(1e300)),
        _ if other > 0.8 => Series::Missing,
        _ => Series::Alternating(size),
    })
}

/// Before and after an instant, for each signal of the module: usual readings unless replaced.
#[derive(Debug, Clone)]
struct Story {
    gages: Vec<[Option<Series>; 2]>,
    pressures: Vec<[Option<Series>; 2]>,
    demands: Vec<[Option<Series>; 2]>,
    /// Steps of the first part.
    before: u64,
    seed: u64,
}

fn story() -> impl Strategy<Value = Story> {
    let own = alone();
    let own = own.structure.module(&own.module).unwrap();
    let (gages, actuators) = (own.gages.len(), own.actuators.len());
    let one = || prop::array::uniform2(prop_oneof![2 => Just(None), 1 => series().prop_map(Some)]);
    (
        prop::collection::vec(one(), gages),
        prop::collection::vec(one(), 2 * actuators),
        prop::collection::vec(one(), actuators),
        prop_oneof![Just(1), Just(WARM_UP), Just(SETTLED)],
        any::<u64>(),
    )
        .prop_map(|(gages, pressures, demands, before, seed)| Story {
            gages,
            pressures,
            demands,
            before,
            seed,
        })
}

impl Story {
    /// The samples, the usual readings replaced.
    fn samples(&self, usual: &mut fixture::RestingSignals, count: u64) -> Vec<Measurements> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut before: Option<Measurements> = None;
        let mut all = Vec::new();
        for step in 0..count {
            let mut sample = usual.sample();
            let (part, since) =
                if step < self.before { (0, step) } else { (1, step - self.before) };
            let mut replace = |of: &[Option<Series>; 2], value: &mut f64, last: f64| {
                if let Some(series) = &of[part] {
                    *value = series.value(since, last, &mut random);
                }
            };
            let last = before.as_ref().unwrap_or(&sample).clone();
            for (k, of) in self.gages.iter().enumerate() {
                replace(of, &mut sample.elongations_m[k], last.elongations_m[k]);
            }
            for (k, of) in self.pressures.iter().enumerate() {
                let chamber = &mut sample.pressures_pa[k / 2][k % 2];
                replace(of, chamber, last.pressures_pa[k / 2][k % 2]);
            }
            for (k, of) in self.demands.iter().enumerate() {
                replace(of, &mut sample.demands_n[k], last.demands_n[k]);
            }
            before = Some(sample.clone());
            all.push(sample);
        }
        all
    }
}

fn excerpts(actions: &[Action]) -> Vec<&Excerpt> {
    let asked = actions.iter().filter_map(|action| match action {
        Action::Identify(excerpt) => Some(&**excerpt),
        _ => None,
    });
    asked.collect()
}

/// Runs a diagnoser on it, identifies what it asks for, and checks what comes out. Returns the windows on the way.
fn endure(setup: ModuleSetup, story: &Story, count: u64) -> Vec<diagnosis::state::WindowMeans> {
    let mut bench = Bench::of(setup);
    let samples = story.samples(&mut bench.signals, count);
    let mut windows = Vec::new();
    for sample in samples {
        bench.give(Event::Sample(sample));
        let lengths = WindowLength::ALL.into_iter();
        windows.extend(lengths.filter_map(|length| bench.diagnoser.window(length)).cloned());
    }
    for excerpt in excerpts(&bench.actions) {
        let found = identify(excerpt, None);
        let all: f64 = found.candidates.iter().map(|candidate| candidate.probability).sum();
        assert!(all <= 1.0 + 1e-9 && !all.is_nan(), "{found:?}");
        for size in found.candidates.iter().filter_map(|candidate| candidate.size) {
            assert!(size.low <= size.value && size.value <= size.high, "{found:?}");
        }
    }
    windows
}

fn reference() -> Arc<Reference> {
    static REFERENCE: LazyLock<Arc<Reference>> = LazyLock::new(|| {
        let setup = alone();
        let learnt = commission(std::slice::from_ref(&setup), 0, &snippets(40, None), 0.001);
        Arc::new(learnt.unwrap())
    });
    Arc::clone(&REFERENCE)
}

/// Snippets under forces that differ, with a story instead of the usual readings in every third if there is one.
fn snippets(count: u64, story: Option<&Story>) -> Vec<Snippet> {
    let setup = alone();
    let setup = ModuleSetup { thresholds: vec![f64::MAX; setup.thresholds.len()], ..setup };
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut snippet = |seed: u64| {
        let mut bench = Bench::of(setup.clone());
        bench.signals.random_from(seed);
        for offset in &mut bench.signals.pressure_offsets {
            *offset = 2e5 * (random.random::<f64>() - 0.5);
        }
        let length = SETTLED + 1500;
        let samples = match story {
            Some(story) if seed.is_multiple_of(3) => story.samples(&mut bench.signals, length),
            _ => (0..length).map(|_| bench.signals.sample()).collect(),
        };
        let mut windows = Vec::new();
        for sample in samples {
            let late = sample.step.0 >= SETTLED;
            bench.give(Event::Sample(sample));
            let lengths = WindowLength::ALL.into_iter().filter(|_| late);
            windows.extend(lengths.filter_map(|l| bench.diagnoser.window(l)).cloned());
        }
        Snippet { label: format!("seed {seed}"), modules: vec![windows] }
    };
    (100..100 + count).map(&mut snippet).collect()
}

/// A gage whose readings have less noise than configured, or none, gets a bias, as a stuck, quiet or coarse one may.
#[test]
fn a_quiet_a_quantised_and_a_stuck_gage_are_identified() {
    for (deviation, resolution) in [
        (0.01 * NOISE_M, 0.0),
        (0.3 * NOISE_M, NOISE_M),
        (0.1 * NOISE_M, 10.0 * NOISE_M),
        (0.0, 0.0),
    ] {
        for reference in [None, Some(reference())] {
            let mut bench = Bench::of(ModuleSetup { reference, ..alone() });
            let mut random = ChaCha8Rng::seed_from_u64(8);
            let quiet = Series::Noise { deviation, resolution };
            for step in 0..SETTLED + 3000 {
                let mut sample = bench.signals.sample();
                for (gage, reading) in sample.elongations_m.iter_mut().enumerate() {
                    let offset = if gage == 1 && step >= SETTLED { BIAS_M } else { 0.0 };
                    *reading = offset + quiet.value(step, 0.0, &mut random);
                }
                bench.give(Event::Sample(sample));
            }
            let found: Vec<_> = excerpts(&bench.actions)
                .into_iter()
                .map(|excerpt| identify(excerpt, None))
                .collect();
            let of_gage = found.iter().rfind(|found| found.component.to_string() == "sensor/g2");
            let of_gage =
                of_gage.unwrap_or_else(|| panic!("not identified: {:?}", bench.latched()));
            assert!(!of_gage.candidates.is_empty(), "deviation {deviation}: {of_gage:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_series_makes_detection_or_identification_panic(story in story()) {
        endure(alone(), &story, story.before + 2500);
    }

    #[test]
    fn no_series_makes_comparison_panic(story in story()) {
        endure(ModuleSetup { reference: Some(reference()), ..alone() }, &story, story.before + 2500);
    }

    /// What is learnt from it can be used, or it is refused.
    #[test]
    fn no_series_makes_commissioning_panic(story in story()) {
        let setup = alone();
        let learnt = commission(std::slice::from_ref(&setup), 0, &snippets(30, Some(&story)), 0.001);
        if let Ok(reference) = learnt {
            let setup = ModuleSetup { reference: Some(Arc::new(reference)), ..setup };
            prop_assert!(Diagnoser::new(setup).is_ok());
        }
    }
}
