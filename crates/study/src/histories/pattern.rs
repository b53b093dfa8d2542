//! How the faults of a history follow each other.

use std::ops::Range;

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

/// A stretch of time in which a component has its fault, in steps from the beginning of the faults.
pub(super) type Stretch = Range<u64>;

/// How the faults of a history follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// One fault that is repaired soon.
    Repaired,
    /// One fault that comes and goes.
    Intermittent,
    /// A second fault after a first that stays.
    Second,
    /// Several, each repaired and perhaps back again.
    Several,
}

/// A time that is as likely between 1 and 2 ms as between 1 and 2 s.
fn any_scale(generator: &mut impl Rng, from: u64, to: u64) -> u64 {
    let exponent = generator.random_range((from as f64).log2()..=(to as f64).log2());
    exponent.exp2() as u64
}

impl Pattern {
    /// All of them.
    pub const ALL: [Pattern; 4] =
        [Pattern::Repaired, Pattern::Intermittent, Pattern::Second, Pattern::Several];

    /// Its name in files and tables, e.g. `intermittent`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Pattern::Repaired => "repaired",
            Pattern::Intermittent => "intermittent",
            Pattern::Second => "second",
            Pattern::Several => "several",
        }
    }

    /// When each of its components has its fault, component by component; steps of a millisecond.
    pub(super) fn draw(self, generator: &mut impl Rng) -> Vec<Vec<Stretch>> {
        match self {
            Pattern::Repaired => vec![once(0, generator.random_range(1..=3000))],
            Pattern::Intermittent => vec![intermittent(generator, 0)],
            Pattern::Second => {
                let later = any_scale(generator, 20, 6000);
                vec![once(0, u64::MAX), once(later, u64::MAX)]
            }
            Pattern::Several => {
                let count = generator.random_range(2..=4);
                (0..count).map(|_| come_and_go(generator)).collect()
            }
        }
    }
}

fn once(from: u64, until: u64) -> Vec<Stretch> {
    std::iter::once(from..until).collect()
}

/// On and off for seconds to half a minute, at a pace of its own.
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

/// One of several: it begins at any time, stays, is repaired, or comes and goes.
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
        for pattern in Pattern::ALL.into_iter().cycle().take(4000) {
            for stretches in pattern.draw(&mut generator) {
                assert!(stretches.iter().all(|stretch| !stretch.is_empty()), "{stretches:?}");
                assert!(stretches.windows(2).all(|pair| pair[0].end < pair[1].start));
            }
        }
    }
}
