//! The question that a run answers, and the run: component, plant, wind and onset. Run `i` of every size and kind has
//! the same wind and noise, and sizes of a kind differ only in the size.

use std::fmt;

use plant::PlantParameters;
use rand::{Rng, RngExt};
use serde::Serialize;
use truss::Structure;
use vocabulary::{
    ComponentPath, Step,
    fault::{Fault, FaultKind},
};

use crate::case::CampaignCase;
use crate::draw::{Draw, components_that_can_have};
use crate::rig::TimedFault;
use crate::system::{System, gage_length_m};

/// Random stream of these runs; runs for isolation keep their earlier stream.
const FIRST_STREAM: u64 = 5 << 60;
const FIRST_ISOLATION_STREAM: u64 = 1 << 62;
/// Earliest and latest onset of a fault after every channel is watched \[s\].
const JUMPS_AFTER_S: [f64; 2] = [0.5, 1.0];
/// How long a fault is followed \[s\]: a jump leaves the change detector's interval after two seconds.
const JUMP_FOLLOWED_S: f64 = 5.0;
const COMPARED_S: f64 = 30.0;
const ISOLATED_WITHIN_S: f64 = 1.0;

/// The measured detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitDetector {
    /// The change detector, for faults that begin with a jump. *Found* is a change that no other fault explains,
    /// *right* one for which its component is declared faulty.
    Change,
    /// The comparison with a reference, for faults present from the first sample on. *Found* is a component declared
    /// faulty or one of several suspects, *right* one declared faulty or the likeliest suspect.
    Reference,
    /// Isolation by the change detector on plants without a reference: *found* and *right* is a component declared
    /// faulty within a second, if no component was declared faulty before the fault.
    Isolation,
}

impl LimitDetector {
    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Change => "change",
            Self::Reference => "reference",
            Self::Isolation => "isolation",
        }
    }
}

/// A kind of fault that has a size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SizedKind {
    /// Offset of a gage, either way \[µε\].
    Bias,
    /// Leak from chamber to chamber \[m²\].
    InternalLeakage,
    /// Leak from either chamber to the outside \[m²\].
    ExternalLeakage,
    /// Offset of a gage, in units of its noise.
    BiasInNoise,
    /// Increments of a gage's random walk per millisecond, in units of its noise.
    WalkInNoise,
    /// Steady drift of a gage per second, in units of its noise.
    DriftInNoise,
    /// Leak of chamber A to the environment. One unit is the area of a leak that changes the force, in the steady state
    /// of the force loop in equilibrium, by the noise of the observed force.
    LeakInNoise,
}

impl SizedKind {
    /// Kinds with an absolute size.
    pub const ABSOLUTE: &[Self] = &[Self::Bias, Self::InternalLeakage, Self::ExternalLeakage];
    /// Kinds whose size is relative to the noise that hides the fault.
    pub const IN_NOISE: &[Self] =
        &[Self::BiasInNoise, Self::WalkInNoise, Self::DriftInNoise, Self::LeakInNoise];

    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Bias | Self::BiasInNoise => "bias",
            Self::InternalLeakage => "internal leakage",
            Self::ExternalLeakage => "external leakage",
            Self::WalkInNoise => "random walk",
            Self::DriftInNoise => "steady drift",
            Self::LeakInNoise => "external leakage of chamber A",
        }
    }

    /// Unit of the size.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Bias => "µε",
            Self::InternalLeakage | Self::ExternalLeakage => "m²",
            Self::BiasInNoise => "gage noise",
            Self::WalkInNoise => "gage noise per ms",
            Self::DriftInNoise => "gage noise per s",
            Self::LeakInNoise => "force noise",
        }
    }

    /// The sizes studied, ascending.
    #[must_use]
    pub fn sizes(self) -> Vec<f64> {
        // steps of a quarter, fine enough to resolve the rise of the curve
        let from = |first: f64, count: i32| (0..count).map(|i| first * 1.25_f64.powi(i)).collect();
        match self {
            Self::Bias => vec![0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0],
            Self::InternalLeakage | Self::ExternalLeakage => {
                vec![1e-9, 2e-9, 5e-9, 1e-8, 2e-8, 5e-8, 1e-7]
            }
            Self::BiasInNoise => from(1.0, 14),
            Self::WalkInNoise => from(0.1, 14),
            Self::DriftInNoise => from(20.0, 20),
            Self::LeakInNoise => from(0.5, 14),
        }
    }

    fn kinds(self) -> &'static [FaultKind] {
        match self {
            Self::Bias | Self::BiasInNoise => &[FaultKind::Bias],
            Self::InternalLeakage => &[FaultKind::InternalLeakage],
            Self::ExternalLeakage => &[FaultKind::ExternalLeakageA, FaultKind::ExternalLeakageB],
            Self::WalkInNoise | Self::DriftInNoise => &[FaultKind::RandomWalk],
            Self::LeakInNoise => &[FaultKind::ExternalLeakageA],
        }
    }

    /// All components that can have such a fault, with the kind.
    fn targets(self, structure: &Structure) -> Vec<(FaultKind, ComponentPath)> {
        let of_kind = |kind: &FaultKind| {
            let kind = *kind;
            let fitting = components_that_can_have(structure, kind).into_iter();
            fitting.map(move |component| (kind, component))
        };
        self.kinds().iter().flat_map(of_kind).collect()
    }

    /// The fault of a size; the sign applies to a bias, which has two directions.
    fn fault(self, size: f64, sign: f64, kind: FaultKind, of: (f64, &PlantParameters)) -> Fault {
        let (length_m, parameters) = of;
        let noise_m = size * parameters.gages.noise_strain * length_m;
        match self {
            Self::Bias => Fault::of_size(kind, sign * size * 1e-6 * length_m),
            Self::BiasInNoise => Fault::of_size(kind, noise_m),
            Self::WalkInNoise => Fault::RandomWalk {
                drift_m_per_s: 0.0,
                increment_m: noise_m * (parameters.step_s / 1e-3).sqrt(),
            },
            Self::DriftInNoise => Fault::RandomWalk { drift_m_per_s: noise_m, increment_m: 0.0 },
            Self::LeakInNoise => Fault::of_size(kind, size * leak_unit_m2(parameters)),
            Self::InternalLeakage | Self::ExternalLeakage => Fault::of_size(kind, size),
        }
    }
}

/// The leak of chamber A whose flow Q in equilibrium the force loop compensates at a force error equal to the noise σ
/// of the observed force: Q = K_P σ, and Q = A √(2 Δp / ρ).
fn leak_unit_m2(parameters: &PlantParameters) -> f64 {
    let h = &parameters.hydraulics;
    let noise_n = h.pressure_noise_pa * h.area_a_m2.hypot(h.area_b_m2);
    let speed = (2.0 * (h.rest_a_pa - h.ambient_pa) / h.oil_density_kg_per_m3).sqrt();
    h.force_gain_m3_per_s_per_n * noise_n / speed
}

/// The question that a run answers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitQuestion {
    /// Index of the run's system.
    pub system: usize,
    /// The detector.
    pub detector: LimitDetector,
    /// The kind of fault.
    pub kind: SizedKind,
    /// The size of the fault, in the unit of its kind.
    pub size: f64,
}

/// `change, bias of 3 µε`
impl fmt::Display for LimitQuestion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { detector, kind, size, .. } = self;
        write!(f, "{}, {} of {size:e} {}", detector.title(), kind.title(), kind.unit())
    }
}

impl LimitQuestion {
    /// The plant of a run among so many: all targets in turn, then again on the next plant.
    pub(super) fn plant(&self, system: &System, run: u64, plants: u64) -> Option<u64> {
        let count = self.kind.targets(&system.structure).len() as u64;
        let turns = run.checked_rem(count)? + run.checked_div(count)?;
        turns.checked_rem(plants).filter(|_| self.detector != LimitDetector::Isolation)
    }

    /// Draws a run; `None` if no component can have such a fault.
    pub(super) fn draw(
        &self,
        system: &System,
        number: u64,
        run: u64,
    ) -> Option<CampaignCase<Self>> {
        let is_isolation = self.detector == LimitDetector::Isolation;
        let first_stream = if is_isolation { FIRST_ISOLATION_STREAM } else { FIRST_STREAM };
        let mut draw = Draw::new(system, first_stream | run);
        let seed = draw.generator.next_u64();
        let sign = if is_isolation { 1.0 } else { draw.sign() };
        let after_s = draw.uniform(JUMPS_AFTER_S);
        let targets = self.kind.targets(&system.structure);
        let place = match is_isolation {
            true => draw.generator.random_range(0..targets.len().max(1)),
            false => run.checked_rem(targets.len() as u64)? as usize,
        };
        let (kind, component) = targets.into_iter().nth(place)?;
        let jumps_at = system.watched_from() + system.steps(after_s);
        let (at, followed_s) = match self.detector {
            LimitDetector::Change => (jumps_at, JUMP_FOLLOWED_S),
            LimitDetector::Reference => (0, COMPARED_S),
            LimitDetector::Isolation => (jumps_at, ISOLATED_WITHIN_S),
        };
        let of = (gage_length_m(&system.structure, &component), &system.parameters);
        let fault = self.kind.fault(self.size, sign, kind, of);
        let injection = TimedFault { at: Step(at), until: None, component, fault };
        let steps = at + system.steps(followed_s);
        Some(CampaignCase::new(number, *self, seed, vec![injection], steps))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn question(kind: SizedKind, size: f64) -> LimitQuestion {
        LimitQuestion { system: 0, detector: LimitDetector::Change, kind, size }
    }

    fn drawn(kind: SizedKind, size: f64, run: u64) -> CampaignCase<LimitQuestion> {
        question(kind, size).draw(&System::tower(9), run, run).unwrap()
    }

    #[test]
    fn every_component_has_its_turn_on_every_plant() {
        for (kind, targets) in [
            (SizedKind::Bias, 16),
            (SizedKind::InternalLeakage, 8),
            (SizedKind::ExternalLeakage, 16),
        ] {
            let visited = |run| {
                let plant = question(kind, 1.0).plant(&System::tower(9), run, 3);
                let fault = drawn(kind, 1.0, run).faults.remove(0);
                (plant, fault.component, fault.fault.kind().as_str())
            };
            let runs: BTreeSet<_> = (0..3 * targets).map(visited).collect();
            assert_eq!(runs.len() as u64, 3 * targets);
        }
    }

    #[test]
    fn sizes_differ_by_nothing_but_the_size() {
        let offset = |run: &CampaignCase<LimitQuestion>| match run.faults[0].fault {
            Fault::Bias { offset_m } => offset_m,
            _ => f64::NAN,
        };
        for number in 0..10 {
            let [small, mut large] = [1.0, 2.0].map(|size| drawn(SizedKind::Bias, size, number));
            assert_eq!(2.0 * offset(&small), offset(&large));
            (large.kind, large.faults[0].fault) = (small.kind, small.faults[0].fault);
            assert_eq!(large, small);
        }
    }
}
