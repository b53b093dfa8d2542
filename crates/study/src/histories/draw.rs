//! What happens in a history: it follows from the campaign's seed and its own number alone.

use std::collections::BTreeMap;

use names::fault::{Fault, FaultKind};
use names::{ComponentPath, Step};
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;

use super::pattern::Pattern;
use crate::campaign::Campaign;
use crate::error::StudyError;
use crate::scenario::{components_that_can_have, draw_fault, gage_length_m, generator};
use crate::schedule::{Injection, Schedule};

/// Histories draw from streams of their own, far from those of scenarios and nominal runs.
const FIRST_STREAM: u64 = 1 << 62;
/// Steps of a millisecond before the first fault: the channels have warmed up.
const BEFORE: u64 = 4000;
/// After the last event: what happened has left the interval, and a second fault has been found.
const AFTER: u64 = 6000;
/// Longest burst of lost samples.
const LONGEST_BURST: u64 = 200;

/// What befalls a diagnoser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Disturbance {
    /// So many of its samples are lost, the one at this step first.
    Lost(u64),
    /// It is restarted before this step, with what it had stored and what the publisher still keeps.
    Restarted,
}

/// A run with faults that come and go.
#[derive(Debug, Clone, PartialEq)]
pub struct History {
    /// Its number, from 0.
    pub number: u64,
    /// Seed of the plant.
    pub seed: u64,
    /// How its faults follow each other.
    pub pattern: Pattern,
    /// Its faults, sorted by their beginning.
    pub injections: Vec<Injection>,
    /// What befalls which diagnoser, by step and place of the diagnoser.
    pub disturbances: BTreeMap<(Step, usize), Disturbance>,
    /// Its length in steps.
    pub steps: u64,
}

impl History {
    /// Draws history `number` of the campaign with this seed. Patterns take turns.
    ///
    /// # Errors
    /// The structure has no component that a fault could befall.
    pub fn draw(campaign: &Campaign, number: u64) -> Result<Self, StudyError> {
        let mut generator = generator(campaign.seed, FIRST_STREAM | number);
        let pattern = Pattern::ALL[(number % Pattern::ALL.len() as u64) as usize];
        let seed = generator.next_u64();
        let per_ms = 1e-3 / campaign.parameters.step_s;
        let steps = |ms: u64| (ms as f64 * per_ms) as u64;
        let begin = steps(BEFORE + generator.random_range(0..=2000));
        let mut injections: Vec<Injection> = Vec::new();
        for stretches in pattern.draw(&mut generator) {
            let taken: Vec<ComponentPath> =
                injections.iter().map(|injection| injection.component.clone()).collect();
            let (component, fault) = draw_fault_of_any_component(campaign, &taken, &mut generator)
                .ok_or(StudyError::NothingToBreak)?;
            injections.extend(stretches.into_iter().map(|stretch| Injection {
                at: Step(begin + steps(stretch.start)),
                until: (stretch.end != u64::MAX).then(|| Step(begin + steps(stretch.end))),
                component: component.clone(),
                fault,
            }));
        }
        injections.sort_by_key(|injection| injection.at);
        let ends = injections.iter().map(|injection| injection.until.unwrap_or(injection.at));
        let last = ends.max().unwrap_or_default();
        let steps = last.0 + steps(AFTER);
        let disturbances = draw_disturbances(campaign.setups.len(), begin..last.0, &mut generator);
        Ok(Self { number, seed, pattern, injections, disturbances, steps })
    }

    /// The schedule that brings its faults about.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule::new(self.injections.clone())
    }

    /// Had the component a fault up to this step?
    #[must_use]
    pub fn was_faulty(&self, component: &ComponentPath, until: Step) -> bool {
        self.injections.iter().any(|i| i.component == *component && i.at <= until)
    }
}

/// Every second history is undisturbed; of the others some lose single samples all the time, some bursts, some
/// have diagnosers that are restarted.
fn draw_disturbances(
    diagnosers: usize,
    steps: std::ops::Range<u64>,
    generator: &mut impl Rng,
) -> BTreeMap<(Step, usize), Disturbance> {
    let mut disturbances = BTreeMap::new();
    let kind = generator.random_range(0..8);
    for diagnoser in 0..diagnosers {
        match kind {
            0 => {
                let lost = steps.clone().filter(|_| generator.random_bool(1e-3));
                disturbances.extend(lost.map(|s| ((Step(s), diagnoser), Disturbance::Lost(1))));
            }
            1 | 2 => {
                for _ in 0..generator.random_range(1..=3) {
                    let at = Step(generator.random_range(steps.clone()));
                    let burst = generator.random_range(1..=LONGEST_BURST);
                    disturbances.insert((at, diagnoser), Disturbance::Lost(burst));
                }
            }
            3 => {
                let at = Step(generator.random_range(steps.clone()));
                disturbances.insert((at, diagnoser), Disturbance::Restarted);
            }
            _ => {}
        }
    }
    disturbances
}

/// A fault of any kind, of a component that is not among those `taken`.
fn draw_fault_of_any_component(
    campaign: &Campaign,
    taken: &[ComponentPath],
    generator: &mut ChaCha8Rng,
) -> Option<(ComponentPath, Fault)> {
    let Campaign { structure, parameters, ranges, .. } = campaign;
    let kind = FaultKind::OF_RESIDUALS[generator.random_range(0..FaultKind::OF_RESIDUALS.len())];
    let mut fitting = components_that_can_have(structure, kind);
    fitting.retain(|component| !taken.contains(component));
    let component = fitting.get(generator.random_range(0..fitting.len().max(1)))?.clone();
    let length_m = gage_length_m(structure, &component);
    let fault = draw_fault(kind, length_m, ranges, parameters, generator)?;
    Some((component, fault))
}
