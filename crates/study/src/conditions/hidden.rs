//! Faults that the change detector cannot see.

use rand::{Rng, RngExt};
use vocabulary::{
    ComponentKind, ComponentPath, Step,
    fault::{Fault, FaultKind},
};

use super::situation::Situation;
use crate::case::{CampaignCase, SampleGap};
use crate::draw::Draw;
use crate::rig::TimedFault;
use crate::system::{System, gage_length_m};

/// Random stream of these cases.
const FIRST_STREAM: u64 = 3 << 61;
/// Sizes are drawn log-uniformly: biases from twice the smallest detectable bias stated by the reference, which is
/// never below this value, up to a multiple of that; and leaks.
const SMALLEST_STRAIN: f64 = 3e-6;
const ABOVE_SMALLEST: [f64; 2] = [2.0, 32.0];
const LEAK_AREA_M2: [f64; 2] = [2e-8, 5e-7];
/// Drifts \[1/s\]: from one microstrain per minute to one per second.
const DRIFT_STRAIN_PER_S: [f64; 2] = [1e-6 / 60.0, 1e-6];
/// A drift is followed until it reaches this multiple of the smallest bias drawn.
const DRIFTED: f64 = 1.7;
/// Time in service, with several comparisons, before the fault \[s\].
const BEFORE_S: f64 = 6.0;
/// Time from the first to the second fault, at most \[s\].
const SECOND_WITHIN_S: f64 = 5.0;
/// Time after the last fault \[s\].
const AFTER_S: f64 = 15.0;

/// Restrictions on hidden faults; by default all sizes and components occur.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HiddenFaults {
    /// All faults that can be biases have this strain, in either direction \[m/m\], and gages take turns. A drift is
    /// followed until it reaches this value.
    pub bias_strain: Option<f64>,
    /// All faults that can be leaks have this coefficient \[m²\]; kinds of leak and cylinders take turns.
    pub leak_m2: Option<f64>,
    /// Duration of a case without a fault \[s\].
    pub healthy_s: Option<f64>,
}

/// The smallest detectable bias of a gage stated by its reference \[m/m\].
type Smallest<'a> = &'a dyn Fn(&ComponentPath) -> f64;

impl HiddenFaults {
    /// Draws a case whose situation had so many turns before. `None` if no component can have the fault.
    pub(super) fn draw(
        self,
        system: &System,
        smallest: Smallest,
        (number, kind): (u64, Situation),
        turn: u64,
    ) -> Option<CampaignCase<Situation>> {
        let structure = &system.structure;
        let mut draw = Draw::new(system, FIRST_STREAM | number);
        let seed = draw.generator.next_u64();
        let mut draw = Hidden { draw, turn, of: self, smallest };
        let mut begin = draw.within(BEFORE_S, BEFORE_S + 2.0);
        let mut gaps = Vec::new();
        let faults = match kind {
            Situation::FromTheStart => vec![draw.any(Step(0), &[])?],
            Situation::InAGap | Situation::WhileDown => {
                let injection = draw.any(Step(begin), &[])?;
                let restarted = kind == Situation::WhileDown;
                let (before, after) =
                    (system.steps(0.2), system.steps(if restarted { 2.0 } else { 1.0 }));
                let mut modules = structure.equipped();
                let place = modules.position(|module| module.name == injection.component.module)?;
                let (from, until) = (Step(begin - before), Step(begin + after));
                gaps.push(SampleGap { place, from, until, restarted });
                vec![injection]
            }
            Situation::Drift => vec![draw.drift(Step(begin))?],
            Situation::Second => {
                let first = draw.any(Step(begin), &[])?;
                let later = draw.within(0.0, SECOND_WITHIN_S);
                let taken = [first.component.clone()];
                let second = draw.any(Step(begin + later), &taken)?;
                vec![first, second]
            }
            Situation::DuringHardOver => {
                let first = draw.of_kind(FaultKind::HardOver, Step(begin), &[])?;
                let later = draw.within(0.0, SECOND_WITHIN_S);
                let second = draw.of_kind(FaultKind::Bias, Step(begin + later), &[])?;
                vec![first, second]
            }
            _ => {
                begin = self.healthy_s.map_or(begin, |length_s| system.steps(length_s));
                Vec::new()
            }
        };
        let last = faults.last();
        let creeping_s = last.map_or(0.0, |last| match last.fault {
            Fault::RandomWalk { drift_m_per_s, .. } if kind == Situation::Drift => {
                let length = gage_length_m(structure, &last.component);
                let [from, _] = sizes(smallest(&last.component));
                self.bias_strain.unwrap_or(DRIFTED * from) * length / drift_m_per_s.abs()
            }
            _ => 0.0,
        });
        let steps = last.map_or(begin, |last| last.at.0) + system.steps(AFTER_S + creeping_s);
        Some(CampaignCase { gaps, ..CampaignCase::new(number, kind, seed, faults, steps) })
    }
}

/// The range of biases drawn for a gage, given the smallest detectable one \[m/m\].
fn sizes(smallest: f64) -> [f64; 2] {
    ABOVE_SMALLEST.map(|times| times * smallest.max(SMALLEST_STRAIN))
}

struct Hidden<'a> {
    draw: Draw<'a>,
    turn: u64,
    of: HiddenFaults,
    smallest: Smallest<'a>,
}

impl Hidden<'_> {
    /// A random time in this range, in steps.
    fn within(&mut self, from_s: f64, to_s: f64) -> u64 {
        let seconds = self.draw.uniform([from_s, to_s]);
        self.draw.system.steps(seconds)
    }

    fn any(&mut self, at: Step, taken: &[ComponentPath]) -> Option<TimedFault> {
        const KINDS: [FaultKind; 5] = [
            FaultKind::InternalLeakage,
            FaultKind::ExternalLeakageA,
            FaultKind::ExternalLeakageB,
            FaultKind::HardOver,
            FaultKind::Bias,
        ];
        if self.of.bias_strain.is_some() {
            return self.of_kind(FaultKind::Bias, at, taken);
        }
        if self.of.leak_m2.is_some() {
            return self.of_kind(KINDS[(self.turn % 3) as usize], at, taken);
        }
        // Gages and cylinders are equally frequent.
        let place = self.draw.generator.random_range(0..2 * (KINDS.len() - 1));
        self.of_kind(KINDS[place.min(KINDS.len() - 1)], at, taken)
    }

    fn of_kind(
        &mut self,
        kind: FaultKind,
        at: Step,
        taken: &[ComponentPath],
    ) -> Option<TimedFault> {
        let component = self.component(kind, taken)?;
        let length = gage_length_m(&self.draw.system.structure, &component);
        let fault = match kind {
            FaultKind::InternalLeakage
            | FaultKind::ExternalLeakageA
            | FaultKind::ExternalLeakageB => Fault::of_size(kind, self.leak_m2()),
            FaultKind::Bias => {
                let bias = self.of.bias_strain;
                let range = bias.map_or_else(|| sizes((self.smallest)(&component)), |b| [b; 2]);
                Fault::of_size(kind, self.signed(range) * length)
            }
            _ => Fault::of_size(kind, 0.0),
        };
        Some(TimedFault { at, until: None, component, fault })
    }

    fn leak_m2(&mut self) -> f64 {
        self.draw.log_uniform(self.of.leak_m2.map_or(LEAK_AREA_M2, |leak| [leak; 2]))
    }

    fn drift(&mut self, at: Step) -> Option<TimedFault> {
        let component = self.component(FaultKind::RandomWalk, &[])?;
        let length = gage_length_m(&self.draw.system.structure, &component);
        let drift_m_per_s = self.signed(DRIFT_STRAIN_PER_S) * length;
        let fault = Fault::RandomWalk { drift_m_per_s, increment_m: 0.0 };
        Some(TimedFault { at, until: None, component, fault })
    }

    fn component(&mut self, kind: FaultKind, taken: &[ComponentPath]) -> Option<ComponentPath> {
        let turn = match kind.component_kind() {
            ComponentKind::Sensor => self.of.bias_strain.map(|_| self.turn),
            ComponentKind::Actuator => self.of.leak_m2.map(|_| self.turn / 3),
        };
        let Some(turn) = turn else { return self.draw.component(kind, taken) };
        let fitting = self.draw.fitting(kind, taken);
        fitting.get((turn % fitting.len().max(1) as u64) as usize).cloned()
    }

    fn signed(&mut self, range: [f64; 2]) -> f64 {
        let size = self.draw.log_uniform(range);
        size * self.draw.sign()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn cases(
        of: HiddenFaults,
        situations: &[Situation],
        count: u64,
    ) -> Vec<CampaignCase<Situation>> {
        let system = System::tower(9);
        let turns = situations.len() as u64;
        let draw = |number| {
            let kind = situations[(number % turns) as usize];
            of.draw(&system, &|_| 0.0, (number, kind), number / turns).unwrap()
        };
        (0..count).map(draw).collect()
    }

    #[test]
    fn biases_of_one_size_visit_every_gage_alike_in_every_situation() {
        let of = HiddenFaults { bias_strain: Some(8e-6), ..HiddenFaults::default() };
        let mut visits = BTreeMap::<_, u64>::new();
        let mut signs = [0, 0];
        for case in cases(of, &Situation::HIDDEN, 7 * 16) {
            for injection in &case.faults {
                match injection.fault {
                    Fault::Bias { offset_m } => {
                        assert!([3.0, 9.0].iter().any(|length| offset_m.abs() > 7.9e-6 * length));
                        signs[usize::from(offset_m > 0.0)] += 1;
                    }
                    Fault::HardOver {} => {
                        assert_eq!(case.kind, Situation::DuringHardOver);
                        continue;
                    }
                    _ => assert_eq!(case.kind, Situation::Drift),
                }
                *visits.entry((case.kind, injection.component.clone())).or_default() += 1;
            }
        }
        assert!(signs[0] > 30 && signs[1] > 30, "{signs:?}");
        // 16 gages in six situations, twice in one of them
        assert_eq!(visits.len(), 6 * 16);
        assert!(visits.iter().all(|((s, _), n)| *n == 1 + u64::from(*s == Situation::Second)));
    }

    #[test]
    fn one_situation_can_be_drawn_alone() {
        for case in cases(HiddenFaults::default(), &[Situation::Second], 30) {
            let [first, second] = &case.faults[..] else { panic!("{case:?}") };
            assert_ne!(first.component, second.component);
            assert_eq!(case.kind, Situation::Second);
        }
    }
}
