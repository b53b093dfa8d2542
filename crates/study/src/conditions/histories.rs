//! Random histories: faults that appear, disappear, recur and overlap, lost samples and restarts.

use std::collections::BTreeMap;
use std::ops::Range;

use rand::{Rng, RngExt};
use vocabulary::{ComponentPath, Step, fault::FaultKind};

use super::situation::Situation;
use crate::case::{CampaignCase, SampleGap};
use crate::draw::Draw;
use crate::rig::TimedFault;
use crate::scenarios::ScenarioRanges;
use crate::system::System;

/// Random stream of histories, far from those of scenarios and nominal runs.
const FIRST_STREAM: u64 = 1 << 62;
/// Steps of a millisecond before the first fault, during which the channels warm up.
const BEFORE: u64 = 4000;
/// Steps after the last event, in which it leaves the interval and a second fault is detected.
const AFTER: u64 = 6000;
/// Longest burst of lost samples.
const LONGEST_BURST: u64 = 200;
/// Duration of the samples stored by the publisher \[s\].
const KEPT_S: f64 = 4.0;

/// A period in which a component has its fault, in steps of a millisecond from the beginning of the faults.
type Stretch = Range<u64>;

/// Draws a history. `None` if no component can have a fault.
pub(super) fn draw(
    system: &System,
    number: u64,
    kind: Situation,
) -> Option<CampaignCase<Situation>> {
    let mut draw = Draw::new(system, FIRST_STREAM | number);
    let seed = draw.generator.next_u64();
    let per_ms = 1e-3 / system.parameters.step_s;
    let steps = |ms: u64| (ms as f64 * per_ms) as u64;
    let begin = steps(BEFORE + draw.generator.random_range(0..=2000));
    let mut faults: Vec<TimedFault> = Vec::new();
    for stretches in stretches(kind, &mut draw.generator) {
        let taken: Vec<ComponentPath> = faults.iter().map(|of| of.component.clone()).collect();
        let fault_kind = draw.one_of(FaultKind::OF_RESIDUALS);
        let component = draw.component(fault_kind, &taken)?;
        let fault = ScenarioRanges::default().fault(fault_kind, &component, &mut draw)?;
        faults.extend(stretches.into_iter().map(|stretch| TimedFault {
            at: Step(begin + steps(stretch.start)),
            until: (stretch.end != u64::MAX).then(|| Step(begin + steps(stretch.end))),
            component: component.clone(),
            fault,
        }));
    }
    faults.sort_by_key(|injection| injection.at);
    let ends = faults.iter().map(|injection| injection.until.unwrap_or(injection.at));
    let last = ends.max().unwrap_or_default();
    let gaps = draw_gaps(system.setups.len(), begin..last.0, &mut draw.generator);
    let (steps, kept_samples) = (last.0 + steps(AFTER), system.steps(KEPT_S) as usize);
    Some(CampaignCase { number, kind, seed, faults, gaps, kept_samples, steps })
}

/// Every second history is undisturbed; some of the others lose single samples all the time, some lose bursts, and in
/// some diagnosers are restarted.
fn draw_gaps(diagnosers: usize, steps: Range<u64>, generator: &mut impl Rng) -> Vec<SampleGap> {
    // The number of samples lost from a step on; `None` if the diagnoser is restarted before the step.
    let mut lost = BTreeMap::<(usize, u64), u64>::new();
    let kind = generator.random_range(0..8);
    for place in 0..diagnosers {
        match kind {
            0 => {
                let each = steps.clone().filter(|_| generator.random_bool(1e-3));
                lost.extend(each.map(|step| ((place, step), 1)));
            }
            1 | 2 => {
                for _ in 0..generator.random_range(1..=3) {
                    let step = generator.random_range(steps.clone());
                    lost.insert((place, step), generator.random_range(1..=LONGEST_BURST));
                }
            }
            3 => {
                lost.insert((place, generator.random_range(steps.clone())), 0);
            }
            _ => {}
        }
    }
    let next = |(place, step): (usize, u64)| {
        let next = lost.range((place, step + 1)..).next();
        next.filter(|((other, _), _)| *other == place).map_or(u64::MAX, |((_, next), _)| *next)
    };
    let gap = |(&(place, from), &lost): (&(usize, u64), &u64)| SampleGap {
        place,
        from: Step(from),
        // A burst ends where the next one begins, even if that is shorter.
        until: Step((from + lost).min(next((place, from)))),
        restarted: lost == 0,
    };
    lost.iter().map(gap).collect()
}

/// A log-uniformly distributed time.
fn any_scale(generator: &mut impl Rng, from: u64, to: u64) -> u64 {
    let exponent = generator.random_range((from as f64).log2()..=(to as f64).log2());
    exponent.exp2() as u64
}

/// The fault periods of each component.
fn stretches(kind: Situation, generator: &mut impl Rng) -> Vec<Vec<Stretch>> {
    match kind {
        Situation::Repaired => vec![once(0, generator.random_range(1..=3000))],
        Situation::Intermittent => vec![intermittent(generator, 0)],
        Situation::Several => {
            let count = generator.random_range(2..=4);
            (0..count).map(|_| come_and_go(generator)).collect()
        }
        _ => {
            let later = any_scale(generator, 20, 6000);
            vec![once(0, u64::MAX), once(later, u64::MAX)]
        }
    }
}

fn once(from: u64, until: u64) -> Vec<Stretch> {
    std::iter::once(from..until).collect()
}

/// On and off for seconds to half a minute, at a random pace.
fn intermittent(generator: &mut impl Rng, from: u64) -> Vec<Stretch> {
    let (pace, over) = (any_scale(generator, 20, 5000), generator.random_range(2000..=30_000));
    let mut phase = || generator.random_range(pace / 2..=pace * 3 / 2).max(1);
    let (mut stretches, mut now) = (Vec::new(), from);
    while now < from + over {
        let end = now + phase();
        stretches.push(now..end);
        now = end + phase();
    }
    stretches
}

/// One of several faults: it begins at a random time, and stays, is repaired, or comes and goes.
fn come_and_go(generator: &mut impl Rng) -> Vec<Stretch> {
    let from = generator.random_range(0..=8000);
    match generator.random_range(0..4) {
        0 => once(from, u64::MAX),
        1 => intermittent(generator, from),
        _ => once(from, from + any_scale(generator, 20, 5000)),
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;

    #[test]
    fn stretches_of_a_component_follow_each_other_and_are_not_empty() {
        let mut generator = ChaCha8Rng::seed_from_u64(5);
        for kind in Situation::HISTORIES.into_iter().cycle().take(4000) {
            for stretches in stretches(kind, &mut generator) {
                assert!(stretches.iter().all(|stretch| !stretch.is_empty()), "{stretches:?}");
                assert!(stretches.windows(2).all(|pair| pair[0].end < pair[1].start));
            }
        }
    }

    #[test]
    fn gaps_of_a_diagnoser_follow_each_other() {
        let mut generator = ChaCha8Rng::seed_from_u64(6);
        for _ in 0..400 {
            let gaps = draw_gaps(2, 4000..6000, &mut generator);
            let follow =
                |pair: &[SampleGap]| pair[0].place < pair[1].place || pair[0].until <= pair[1].from;
            assert!(gaps.windows(2).all(follow), "{gaps:?}");
            assert!(gaps.iter().all(|gap| gap.restarted == (gap.from == gap.until)), "{gaps:?}");
        }
    }
}
