//! Which fault when, and which diagnoser is killed when: drawn from a seed.

use std::ops::Range;

use daemon::config::{Schedule, ScheduledFault};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vocabulary::{Step, fault::Fault};

/// The first onset: every channel is watched by then.
const FIRST_ONSET: u64 = 3300;
/// From one onset to the next \[steps\].
const BETWEEN_ONSETS: u64 = 1000;
/// How long a fault lasts \[steps\].
const LASTING: u64 = 1500;
/// Gages of each module.
const GAGES: u64 = 8;
/// Kills between two audits of the histories.
const BATCH: usize = 20;
/// Onsets without a kill during an audit.
const BREAK: u64 = 2;
/// A kill is at most this many steps before or after its onset.
const AROUND: Range<i64> = -100..250;
/// One onset in this many has a second kill soon after the first.
const SECOND_IN: u32 = 2;
/// Steps after the first kill: most often a diagnoser is still starting.
const SOON: Range<u64> = 20..400;

/// A diagnoser to be killed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kill {
    /// When the plant is at this step.
    pub at_step: u64,
    /// Place of its module.
    pub victim: usize,
}

/// What is to happen.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The faults.
    pub schedule: Schedule,
    /// The kills, in batches with breaks between them.
    pub batches: Vec<Vec<Kill>>,
    /// When everything has happened.
    pub over: u64,
}

impl Plan {
    /// Draws this many kills, and a fault every second as long as they last.
    #[must_use]
    pub fn draw(seed: u64, kills: usize) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut onsets = 0;
        let mut batches = Vec::new();
        for begun in (0..kills).step_by(BATCH) {
            let size = BATCH.min(kills - begun);
            batches.push(draw_batch(&mut random, &mut onsets, size));
            onsets += BREAK;
        }
        let faults = (0..onsets).map(|number| draw_fault(&mut random, number)).collect();
        let over = onset(onsets) + LASTING;
        Self { schedule: Schedule { faults }, batches, over }
    }
}

fn onset(number: u64) -> u64 {
    FIRST_ONSET + BETWEEN_ONSETS * number
}

fn draw_batch(random: &mut ChaCha8Rng, onsets: &mut u64, size: usize) -> Vec<Kill> {
    let mut batch = Vec::new();
    while batch.len() < size {
        let mut at_step = onset(*onsets).saturating_add_signed(random.random_range(AROUND));
        batch.push(Kill { at_step, victim: random.random_range(0..2) });
        if batch.len() < size && random.random_range(0..SECOND_IN) == 0 {
            at_step += random.random_range(SOON);
            batch.push(Kill { at_step, victim: random.random_range(0..2) });
        }
        *onsets += 1;
    }
    batch
}

/// A bias of one gage after the other, in both modules in turn.
fn draw_fault(random: &mut ChaCha8Rng, number: u64) -> ScheduledFault {
    let (module, gage) = (number % 2 + 1, number / 2 % GAGES + 1);
    let size = random.random_range(1.5e-4..6e-4);
    let offset_m = if random.random::<bool>() { size } else { -size };
    let at_step = onset(number);
    ScheduledFault {
        at_step: Step(at_step),
        until_step: Some(Step(at_step + LASTING)),
        component: format!("module{module}/sensor/g{gage}").parse().unwrap(),
        fault: Fault::Bias { offset_m },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_kills_as_wanted_in_order_of_both_modules_and_the_same_from_the_same_seed() {
        let plan = Plan::draw(7, 50);
        assert_eq!(plan, Plan::draw(7, 50));
        assert_ne!(plan, Plan::draw(8, 50));
        let sizes: Vec<usize> = plan.batches.iter().map(Vec::len).collect();
        assert_eq!(sizes, [20, 20, 10]);
        let kills: Vec<Kill> = plan.batches.into_iter().flatten().collect();
        assert!(kills.is_sorted_by_key(|kill| kill.at_step));
        assert!([0, 1].iter().all(|module| kills.iter().any(|kill| kill.victim == *module)));
        assert!(kills.iter().all(|kill| kill.at_step < plan.over));
    }

    #[test]
    fn a_fault_of_a_gage_is_over_long_before_its_next_one() {
        let plan = Plan::draw(7, 100);
        for (place, fault) in plan.schedule.faults.iter().enumerate() {
            let mut later = plan.schedule.faults[place + 1..].iter();
            if let Some(next) = later.find(|next| next.component == fault.component) {
                assert!(next.at_step.since(fault.until_step.unwrap()) > 10_000);
            }
        }
    }
}
