//! What is wrong in a case, and when: it follows from the seed and the case's number alone.

use names::fault::{Fault, FaultKind};
use names::{ComponentKind, ComponentPath, Step};
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use truss::Structure;

use crate::scenario::{components_that_can_have, gage_length_m, generator};
use crate::schedule::{Injection, Schedule};

/// Cases draw from streams of their own.
const FIRST_STREAM: u64 = 3 << 61;
/// The sizes drawn, as likely between 1 and 2 as between 10 and 20: biases from twice the smallest that is stated to be
/// found on, which is never less than this, over so many times that; and leaks.
const SMALLEST_STRAIN: f64 = 3e-6;
const ABOVE_SMALLEST: [f64; 2] = [2.0, 32.0];
const LEAK_AREA_M2: [f64; 2] = [2e-8, 5e-7];
/// Drifts \[1/s\]: from a microstrain a minute to one a second.
const DRIFT_STRAIN_PER_S: [f64; 2] = [1e-6 / 60.0, 1e-6];
/// A drift is followed until it has come to so many times the least bias drawn.
const DRIFTED: f64 = 1.7;
/// In service, compared several times, before something happens \[s\].
const BEFORE_S: f64 = 6.0;
/// A second fault follows the first within this time \[s\].
const SECOND_WITHIN_S: f64 = 5.0;
/// After the last fault \[s\].
const AFTER_S: f64 = 15.0;

/// How a fault hides from the change detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Situation {
    /// Nothing is wrong.
    Healthy,
    /// It is there from the first step on.
    FromTheStart,
    /// It begins while samples are lost.
    InAGap,
    /// It begins while its diagnoser is down for longer than samples are kept.
    WhileDown,
    /// A gage drifts slowly.
    Drift,
    /// It begins within five seconds of another one.
    Second,
    /// A gage fails while a cylinder is hard over.
    DuringHardOver,
}

impl Situation {
    /// All of them.
    pub const ALL: [Situation; 7] = [
        Situation::Healthy,
        Situation::FromTheStart,
        Situation::InAGap,
        Situation::WhileDown,
        Situation::Drift,
        Situation::Second,
        Situation::DuringHardOver,
    ];

    /// Its name in files.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Situation::Healthy => "healthy",
            Situation::FromTheStart => "from_the_start",
            Situation::InAGap => "in_a_gap",
            Situation::WhileDown => "while_down",
            Situation::Drift => "drift",
            Situation::Second => "second",
            Situation::DuringHardOver => "during_hard_over",
        }
    }
}

/// A stretch of steps that one diagnoser does not see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Blind {
    /// Place of the diagnoser.
    pub place: usize,
    /// First step that it does not see.
    pub from: Step,
    /// First step that it sees again.
    pub until: Step,
    /// It is restarted then.
    pub restarted: bool,
}

/// Which cases are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CaseKind {
    /// All hide in this way; otherwise situations take turns.
    pub situation: Option<Situation>,
    /// Every fault that may be one is a bias of this strain, either way \[m/m\], and gages take turns. A drift is
    /// followed until it has come so far.
    pub bias_strain: Option<f64>,
    /// Every fault that may be one is a leak of this coefficient \[m²\]; kinds of leak and cylinders take turns.
    pub leak_m2: Option<f64>,
    /// How long nothing is wrong in a case in which nothing is \[s\].
    pub healthy_s: Option<f64>,
}

impl CaseKind {
    /// The situation of a case, and how often each of its gages has had its turn before.
    fn turn(self, number: u64) -> (Situation, u64) {
        let situations = Situation::ALL.len() as u64;
        match self.situation {
            Some(situation) => (situation, number),
            None => (Situation::ALL[(number % situations) as usize], number / situations),
        }
    }
}

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Its number, from 0.
    pub number: u64,
    /// Seed of the plant's run.
    pub seed: u64,
    /// How its faults hide.
    pub situation: Situation,
    /// Its faults, in their order.
    pub injections: Vec<Injection>,
    /// What nobody sees.
    pub blind: Option<Blind>,
    /// Its length.
    pub steps: u64,
}

impl Case {
    /// Draws case `number` of a campaign of this kind. `smallest` tells the smallest bias of a gage \[m/m\] that is stated
    /// to be found. `None` if nothing can break.
    #[must_use]
    pub fn draw(
        kind: CaseKind,
        smallest: &dyn Fn(&ComponentPath) -> f64,
        structure: &Structure,
        step_s: f64,
        campaign_seed: u64,
        number: u64,
    ) -> Option<Self> {
        let mut generator = generator(campaign_seed, FIRST_STREAM | number);
        let (situation, turn) = kind.turn(number);
        let seed = generator.next_u64();
        let bias = kind.bias_strain.map(|size| Sized { size, turn });
        let leak = kind.leak_m2.map(|size| Sized { size, turn });
        let mut draw = Draw { structure, step_s, bias, leak, smallest, generator: &mut generator };
        let mut begin = draw.within(BEFORE_S, BEFORE_S + 2.0);
        let mut blind = None;
        let injections = match situation {
            Situation::Healthy => {
                begin = kind.healthy_s.map_or(begin, |length_s| draw.steps(length_s));
                Vec::new()
            }
            Situation::FromTheStart => vec![draw.any(Step(0), &[])?],
            Situation::InAGap | Situation::WhileDown => {
                let injection = draw.any(Step(begin), &[])?;
                let restarted = situation == Situation::WhileDown;
                let (before, after) =
                    (draw.steps(0.2), draw.steps(if restarted { 2.0 } else { 1.0 }));
                let mut modules = structure.equipped();
                let place = modules.position(|module| module.name == injection.component.module)?;
                let (from, until) = (Step(begin - before), Step(begin + after));
                blind = Some(Blind { place, from, until, restarted });
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
        };
        let last = injections.last();
        let creeping_s = last.map_or(0.0, |last| match last.fault {
            Fault::RandomWalk { drift_m_per_s, .. } if situation == Situation::Drift => {
                let length = gage_length_m(structure, &last.component);
                let [from, _] = sizes(smallest(&last.component));
                kind.bias_strain.unwrap_or(DRIFTED * from) * length / drift_m_per_s.abs()
            }
            _ => 0.0,
        });
        let after = draw.steps(AFTER_S + creeping_s);
        let steps = last.map_or(begin, |last| last.at.0) + after;
        Some(Self { number, seed, situation, injections, blind, steps })
    }

    /// The schedule that brings its faults about.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule::new(self.injections.clone())
    }
}

/// A fault of a given size, and whose turn it is.
#[derive(Debug, Clone, Copy)]
struct Sized {
    size: f64,
    turn: u64,
}

/// The biases drawn of a gage of which this is the smallest that is stated to be found \[m/m\].
fn sizes(smallest: f64) -> [f64; 2] {
    ABOVE_SMALLEST.map(|times| times * smallest.max(SMALLEST_STRAIN))
}

struct Draw<'a> {
    structure: &'a Structure,
    step_s: f64,
    bias: Option<Sized>,
    leak: Option<Sized>,
    smallest: &'a dyn Fn(&ComponentPath) -> f64,
    generator: &'a mut ChaCha8Rng,
}

impl Draw<'_> {
    fn steps(&self, seconds: f64) -> u64 {
        (seconds / self.step_s).round() as u64
    }

    /// So many seconds, in steps.
    fn within(&mut self, from_s: f64, to_s: f64) -> u64 {
        let seconds = self.generator.random_range(from_s..=to_s);
        self.steps(seconds)
    }

    fn any(&mut self, at: Step, taken: &[ComponentPath]) -> Option<Injection> {
        const KINDS: [FaultKind; 5] = [
            FaultKind::InternalLeakage,
            FaultKind::ExternalLeakageA,
            FaultKind::ExternalLeakageB,
            FaultKind::HardOver,
            FaultKind::Bias,
        ];
        if self.bias.is_some() {
            return self.of_kind(FaultKind::Bias, at, taken);
        }
        if let Some(leak) = self.leak {
            return self.of_kind(KINDS[(leak.turn % 3) as usize], at, taken);
        }
        // As many gages as cylinders.
        let place = self.generator.random_range(0..2 * (KINDS.len() - 1));
        self.of_kind(KINDS[place.min(KINDS.len() - 1)], at, taken)
    }

    fn of_kind(&mut self, kind: FaultKind, at: Step, taken: &[ComponentPath]) -> Option<Injection> {
        let component = self.component(kind, taken)?;
        let length = gage_length_m(self.structure, &component);
        let fault = match kind {
            FaultKind::InternalLeakage => Fault::InternalLeakage { area_m2: self.leak_m2() },
            FaultKind::ExternalLeakageA => Fault::ExternalLeakageA { area_m2: self.leak_m2() },
            FaultKind::ExternalLeakageB => Fault::ExternalLeakageB { area_m2: self.leak_m2() },
            FaultKind::HardOver => Fault::HardOver {},
            _ => {
                let range = self
                    .bias
                    .map_or_else(|| sizes((self.smallest)(&component)), |bias| [bias.size; 2]);
                Fault::Bias { offset_m: self.signed(range) * length }
            }
        };
        Some(Injection { at, until: None, component, fault })
    }

    fn leak_m2(&mut self) -> f64 {
        let range = self.leak.map_or(LEAK_AREA_M2, |leak| [leak.size; 2]);
        self.log_uniform(range)
    }

    fn drift(&mut self, at: Step) -> Option<Injection> {
        let component = self.component(FaultKind::RandomWalk, &[])?;
        let length = gage_length_m(self.structure, &component);
        let drift_m_per_s = self.signed(DRIFT_STRAIN_PER_S) * length;
        let fault = Fault::RandomWalk { drift_m_per_s, increment_m: 0.0 };
        Some(Injection { at, until: None, component, fault })
    }

    fn component(&mut self, kind: FaultKind, taken: &[ComponentPath]) -> Option<ComponentPath> {
        let mut fitting = components_that_can_have(self.structure, kind);
        fitting.retain(|component| !taken.contains(component));
        let count = fitting.len().max(1);
        let turn = match kind.component_kind() {
            ComponentKind::Sensor => self.bias.map(|bias| bias.turn),
            ComponentKind::Actuator => self.leak.map(|leak| leak.turn / 3),
        };
        let place = match turn {
            Some(turn) => (turn % count as u64) as usize,
            None => self.generator.random_range(0..count),
        };
        fitting.get(place).cloned()
    }

    fn log_uniform(&mut self, [from, to]: [f64; 2]) -> f64 {
        self.generator.random_range(from.ln()..=to.ln()).exp()
    }

    fn signed(&mut self, range: [f64; 2]) -> f64 {
        let size = self.log_uniform(range);
        if self.generator.random() { size } else { -size }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn cases(kind: CaseKind, count: u64) -> Vec<Case> {
        let text = include_str!("../../../../configs/tower.toml");
        let tower = Structure::from_toml(text).unwrap();
        let draw = |number| Case::draw(kind, &|_| 0.0, &tower, 1e-3, 9, number).unwrap();
        (0..count).map(draw).collect()
    }

    #[test]
    fn biases_of_one_size_visit_every_gage_alike_in_every_situation() {
        let kind = CaseKind { bias_strain: Some(8e-6), ..CaseKind::default() };
        let mut visits = BTreeMap::<_, u64>::new();
        let mut signs = [0, 0];
        for case in cases(kind, 7 * 16) {
            for injection in &case.injections {
                match injection.fault {
                    Fault::Bias { offset_m } => {
                        assert!([3.0, 9.0].iter().any(|length| offset_m.abs() > 7.9e-6 * length));
                        signs[usize::from(offset_m > 0.0)] += 1;
                    }
                    Fault::HardOver {} => {
                        assert_eq!(case.situation, Situation::DuringHardOver);
                        continue;
                    }
                    _ => assert_eq!(case.situation, Situation::Drift),
                }
                *visits.entry((case.situation, injection.component.clone())).or_default() += 1;
            }
        }
        assert!(signs[0] > 30 && signs[1] > 30, "{signs:?}");
        // 16 gages in six situations, twice in one of them
        assert_eq!(visits.len(), 6 * 16);
        assert!(visits.iter().all(|((s, _), n)| *n == 1 + u64::from(*s == Situation::Second)));
    }

    #[test]
    fn one_situation_can_be_drawn_alone() {
        let kind = CaseKind { situation: Some(Situation::Second), ..CaseKind::default() };
        for case in cases(kind, 30) {
            let [first, second] = &case.injections[..] else { panic!("{case:?}") };
            assert_ne!(first.component, second.component);
            assert_eq!(case.situation, Situation::Second);
        }
    }
}
