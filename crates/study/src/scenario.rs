//! Random scenarios: which component gets which fault, how large and when.
//!
//! A scenario follows from the campaign's seed and its own number alone: it is the same whatever was
//! run before, with whom and in which order.

use names::fault::{Fault, FaultKind};
use names::{Component, ComponentPath, Step};
use plant::PlantParameters;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use truss::Structure;

use crate::schedule::{Injection, Schedule};

/// Nominal runs draw from streams of their own, far from those of the scenarios.
const FIRST_NOMINAL_STREAM: u64 = 1 << 63;

/// From what a scenario is drawn, each uniformly; as in the tower's figures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScenarioRanges {
    /// Length of a run with a fault \[s\].
    pub length_s: f64,
    /// Length of a run without a fault \[s\].
    pub nominal_s: f64,
    /// When the fault begins \[s\].
    pub onset_s: [f64; 2],
    /// Leak coefficient \[m²\].
    pub leak_area_m2: [f64; 2],
    /// Bias, as strain of the gage \[m/m\].
    pub bias_strain: [f64; 2],
    /// Mean drift of a random walk, as strain \[1/s\].
    pub drift_strain_per_s: [f64; 2],
    /// Standard deviation of a random walk's increment in a step, as strain \[m/m\].
    pub increment_strain: [f64; 2],
}

impl Default for ScenarioRanges {
    fn default() -> Self {
        Self {
            length_s: 15.0,
            nominal_s: 15.0,
            onset_s: [10.5, 11.5],
            leak_area_m2: [1e-7, 5e-7],
            bias_strain: [0.0, 100e-6],
            drift_strain_per_s: [-20e-6, 20e-6],
            increment_strain: [1e-6, 3e-6],
        }
    }
}

/// One run with a fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Its number in the campaign, from 0.
    pub number: u64,
    /// Seed of the plant: wind, loads, noise, mismatch.
    pub seed: u64,
    /// Its fault.
    pub injection: Injection,
}

impl Scenario {
    /// Draws scenario `number` of the campaign with this seed. Kinds of fault take turns, so that every
    /// kind is equally frequent.
    #[must_use]
    pub fn draw(
        campaign_seed: u64,
        number: u64,
        structure: &Structure,
        parameters: &PlantParameters,
        ranges: &ScenarioRanges,
    ) -> Option<Self> {
        let mut generator = generator(campaign_seed, number);
        let kinds = FaultKind::OF_RESIDUALS;
        let kind = kinds[(number % kinds.len() as u64) as usize];
        let seed = generator.next_u64();
        let [from, to] = ranges.onset_s;
        let onset_s = generator.random_range(from..=to);
        let component = draw_component(structure, kind, &mut generator)?;
        let fault = draw_fault(
            kind,
            gage_length_m(structure, &component),
            ranges,
            parameters,
            &mut generator,
        )?;
        let at = Step((onset_s / parameters.step_s).round() as u64);
        Some(Self { number, seed, injection: Injection { at, until: None, component, fault } })
    }

    /// The kind of its fault.
    #[must_use]
    pub fn kind(&self) -> FaultKind {
        self.injection.fault.kind()
    }

    /// The schedule that brings it about.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule::new(vec![self.injection.clone()])
    }
}

/// Seed of the plant of nominal run `number` of the campaign with this seed.
#[must_use]
pub fn nominal_seed(campaign_seed: u64, number: u64) -> u64 {
    generator(campaign_seed, FIRST_NOMINAL_STREAM | number).next_u64()
}

pub(crate) fn generator(campaign_seed: u64, stream: u64) -> ChaCha8Rng {
    let mut generator = ChaCha8Rng::seed_from_u64(campaign_seed);
    generator.set_stream(stream);
    generator
}

/// Any component of the structure that can have this fault, each as likely as the other.
fn draw_component(
    structure: &Structure,
    kind: FaultKind,
    generator: &mut ChaCha8Rng,
) -> Option<ComponentPath> {
    let fitting = components_that_can_have(structure, kind);
    // An empty list has no first component either.
    fitting.get(generator.random_range(0..fitting.len().max(1))).cloned()
}

/// The components of the structure that can have this kind of fault, module by module.
pub(crate) fn components_that_can_have(
    structure: &Structure,
    kind: FaultKind,
) -> Vec<ComponentPath> {
    let paths = structure.equipped().flat_map(|module| {
        let of = |component| ComponentPath { module: module.name.clone(), component };
        module.components().map(of)
    });
    paths.filter(|path| path.component.kind() == kind.component_kind()).collect()
}

/// Length of the gage; of no meaning for an actuator.
pub(crate) fn gage_length_m(structure: &Structure, path: &ComponentPath) -> f64 {
    let module = structure.module(&path.module);
    let gages = module.map(|module| module.gages.as_slice()).unwrap_or_default();
    let gage = gages.iter().find(|gage| match &path.component {
        Component::Sensor(name) => gage.name == *name,
        Component::Actuator(_) => false,
    });
    gage.map_or(f64::NAN, |gage| structure.gage_length_m(gage))
}

/// A fault of this kind; `length_m` is that of its gage. `None` for a kind that no campaign draws.
pub(crate) fn draw_fault(
    kind: FaultKind,
    length_m: f64,
    ranges: &ScenarioRanges,
    parameters: &PlantParameters,
    generator: &mut ChaCha8Rng,
) -> Option<Fault> {
    let mut uniform = |[from, to]: [f64; 2]| generator.random_range(from..=to);
    Some(match kind {
        FaultKind::InternalLeakage => {
            Fault::InternalLeakage { area_m2: uniform(ranges.leak_area_m2) }
        }
        FaultKind::ExternalLeakageA => {
            Fault::ExternalLeakageA { area_m2: uniform(ranges.leak_area_m2) }
        }
        FaultKind::ExternalLeakageB => {
            Fault::ExternalLeakageB { area_m2: uniform(ranges.leak_area_m2) }
        }
        FaultKind::HardOver => Fault::HardOver {},
        FaultKind::Bias => Fault::Bias { offset_m: length_m * uniform(ranges.bias_strain) },
        FaultKind::RandomWalk => Fault::RandomWalk {
            drift_m_per_s: length_m * uniform(ranges.drift_strain_per_s),
            // the range is for steps of a millisecond; a walk's spread grows with the root of time
            increment_m: length_m
                * uniform(ranges.increment_strain)
                * (parameters.step_s / 1e-3).sqrt(),
        },
        FaultKind::ZeroOutput => Fault::ZeroOutput {},
        FaultKind::Stiction
        | FaultKind::Drift
        | FaultKind::Gain
        | FaultKind::Stuck
        | FaultKind::Intermittent
        | FaultKind::NoSignal => return None,
    })
}
