//! The runs: which component of which plant, in which wind, faulty since when. Run `i` of every size and kind has the
//! same wind and noise, and sizes of a kind differ by nothing but the size.

use names::fault::{Fault, FaultKind};
use names::{ComponentPath, Step};
use rand::{Rng, RngExt};
use truss::Structure;

use super::curve::{Detector, SizedKind};
use crate::conditions::ConditionCampaign;
use crate::power_study::watched_from;
use crate::scenario::{components_that_can_have, gage_length_m, generator};
use crate::schedule::Injection;

/// Runs draw from streams of their own.
const FIRST_STREAM: u64 = 5 << 60;
/// A fault jumps in this long after every channel is watched, at the earliest and the latest \[s\].
const JUMPS_AFTER_S: [f64; 2] = [0.5, 1.0];
/// How long a fault is followed \[s\]: a jump leaves the change detector's interval after two seconds.
const JUMP_FOLLOWED_S: f64 = 5.0;
const COMPARED_S: f64 = 30.0;

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Run {
    /// Place of its plant among those commissioned.
    pub(super) plant: usize,
    /// Seed of its wind, loads and noise.
    pub(super) seed: u64,
    /// Its fault.
    pub(super) injection: Injection,
    /// Its length.
    pub(super) steps: u64,
}

impl Run {
    /// Draws run `number` with a fault of this size on one of so many plants; `None` if nothing can
    /// have it.
    pub(super) fn draw(
        campaign: &ConditionCampaign,
        plants: usize,
        (detector, kind): (Detector, SizedKind),
        size: f64,
        number: u64,
    ) -> Option<Self> {
        let mut generator = generator(campaign.seed, FIRST_STREAM | number);
        let seed = generator.next_u64();
        let signed = if generator.random() { size } else { -size };
        let [from, to] = JUMPS_AFTER_S;
        let after_s = generator.random_range(from..=to);
        let steps = |seconds: f64| (seconds / campaign.parameters.step_s).round() as u64;
        let (at, followed_s) = match detector {
            Detector::Change => (watched_from(&campaign.setups) + steps(after_s), JUMP_FOLLOWED_S),
            Detector::Reference => (0, COMPARED_S),
        };
        let targets = kind.targets(&campaign.structure);
        let count = targets.len() as u64;
        let (round, turn) = (number.checked_div(count)?, number.checked_rem(count)?);
        // Every target in turn, in the next round on the next plant.
        let plant = (turn + round).checked_rem(plants as u64)?;
        let (fault_kind, component) = targets.into_iter().nth(turn as usize)?;
        let fault = match fault_kind {
            FaultKind::InternalLeakage => Fault::InternalLeakage { area_m2: size },
            FaultKind::ExternalLeakageA => Fault::ExternalLeakageA { area_m2: size },
            FaultKind::ExternalLeakageB => Fault::ExternalLeakageB { area_m2: size },
            _ => {
                let length_m = gage_length_m(&campaign.structure, &component);
                Fault::Bias { offset_m: signed * 1e-6 * length_m }
            }
        };
        let injection = Injection { at: Step(at), until: None, component, fault };
        Some(Self { plant: plant as usize, seed, injection, steps: at + steps(followed_s) })
    }
}

impl SizedKind {
    /// Whatever can have such a fault, and which.
    fn targets(self, structure: &Structure) -> Vec<(FaultKind, ComponentPath)> {
        let kinds: &[FaultKind] = match self {
            SizedKind::Bias => &[FaultKind::Bias],
            SizedKind::InternalLeakage => &[FaultKind::InternalLeakage],
            SizedKind::ExternalLeakage => {
                &[FaultKind::ExternalLeakageA, FaultKind::ExternalLeakageB]
            }
        };
        let of_kind = |kind: &FaultKind| {
            let kind = *kind;
            let fitting = components_that_can_have(structure, kind).into_iter();
            fitting.map(move |component| (kind, component))
        };
        kinds.iter().flat_map(of_kind).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use plant::PlantParameters;

    use super::*;
    use crate::conditions::CaseKind;

    fn drawn(kind: SizedKind, size: f64, number: u64) -> Run {
        let text = include_str!("../../../../configs/tower.toml");
        let campaign = ConditionCampaign {
            structure: Structure::from_toml(text).unwrap(),
            parameters: PlantParameters::default(),
            setups: Vec::new(),
            mismatch: 0.1,
            seed: 9,
            cases_per_plant: 0,
            kind: CaseKind::default(),
        };
        Run::draw(&campaign, 3, (Detector::Change, kind), size, number).unwrap()
    }

    #[test]
    fn every_component_has_its_turn_on_every_plant() {
        for (kind, targets) in [
            (SizedKind::Bias, 16),
            (SizedKind::InternalLeakage, 8),
            (SizedKind::ExternalLeakage, 16),
        ] {
            let visited = |run: Run| {
                let (component, fault) = (run.injection.component, run.injection.fault.kind());
                (run.plant, component, fault.as_str())
            };
            let runs = (0..3 * targets).map(|number| visited(drawn(kind, 1.0, number)));
            assert_eq!(runs.collect::<BTreeSet<_>>().len() as u64, 3 * targets);
        }
    }

    #[test]
    fn sizes_differ_by_nothing_but_the_size() {
        let offset = |run: &Run| match run.injection.fault {
            Fault::Bias { offset_m } => offset_m,
            _ => f64::NAN,
        };
        for number in 0..10 {
            let [small, large] = [1.0, 2.0].map(|size| drawn(SizedKind::Bias, size, number));
            assert_eq!(2.0 * offset(&small), offset(&large));
            let injection = Injection { fault: small.injection.fault, ..large.injection };
            assert_eq!(Run { injection, ..large }, small);
        }
    }
}
