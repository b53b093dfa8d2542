//! The seeded decision about each frame of one node to another, and the count of decisions.

use parking_lot::{Mutex, MutexGuard};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::impairment::{Fate, Impairment};

/// What became of the frames of one node to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Arrived, or still on the way.
    pub forwarded: u64,
    /// Lost by chance.
    pub lost: u64,
    /// Not sent for there was no way.
    pub cut: u64,
}

/// One direction between two nodes.
#[derive(Debug)]
pub(super) struct Link(Mutex<State>);

#[derive(Debug)]
struct State {
    impairment: Impairment,
    generator: ChaCha8Rng,
    tally: Tally,
}

impl Link {
    /// The same seed and stream decide the same about the same sequence of frames.
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(stream);
        let impairment = Impairment::default();
        Self(Mutex::new(State { impairment, generator, tally: Tally::default() }))
    }

    pub(super) fn impair(&self, impairment: Impairment) {
        self.state().impairment = impairment;
    }

    pub(super) fn tally(&self) -> Tally {
        self.state().tally
    }

    /// Decides about the next frame. Two numbers are drawn for each, for any impairment, so that
    /// what happens to a frame depends on how many there were before and not on when the impairment
    /// was changed.
    pub(super) fn decide(&self) -> Fate {
        let mut state = self.state();
        let numbers = (state.generator.random(), state.generator.random());
        let fate = state.impairment.fate(numbers.0, numbers.1);
        let counter = match fate {
            Fate::Forwarded { .. } => &mut state.tally.forwarded,
            Fate::Lost => &mut state.tally.lost,
            Fate::Cut => &mut state.tally.cut,
        };
        *counter += 1;
        fate
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn fates(link: &Link, impairment: Impairment, count: usize) -> Vec<Fate> {
        link.impair(impairment);
        (0..count).map(|_| link.decide()).collect()
    }

    fn poor() -> Impairment {
        Impairment {
            loss: 0.3,
            ..Impairment::delay(Duration::from_secs(1), Duration::from_secs(1))
        }
    }

    #[test]
    fn the_same_seed_decides_the_same_about_the_same_frames() {
        let (one, other) = (Link::new(7, 3), Link::new(7, 3));
        assert_eq!(fates(&one, poor(), 1000), fates(&other, poor(), 1000));
    }

    #[test]
    fn other_seeds_and_other_links_decide_otherwise() {
        let of = |seed, stream| fates(&Link::new(seed, stream), poor(), 100);
        assert_ne!(of(7, 3), of(8, 3));
        assert_ne!(of(7, 3), of(7, 4));
    }

    #[test]
    fn what_was_the_matter_before_does_not_change_what_happens_to_later_frames() {
        let (one, other) = (Link::new(7, 3), Link::new(7, 3));
        fates(&one, Impairment::cut(), 50);
        fates(&other, Impairment::default(), 50);
        assert_eq!(fates(&one, poor(), 100), fates(&other, poor(), 100));
    }

    #[test]
    fn decisions_are_counted_by_their_kind() {
        let link = Link::new(1, 1);
        let lost = fates(&link, Impairment::loss(0.5), 1000);
        let lost = lost.into_iter().filter(|fate| *fate == Fate::Lost).count() as u64;
        fates(&link, Impairment::cut(), 10);
        assert_eq!(link.tally(), Tally { forwarded: 1000 - lost, lost, cut: 10 });
        // Ten standard deviations.
        assert!(lost.abs_diff(500) < 160, "{lost}");
    }
}
