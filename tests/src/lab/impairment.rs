//! What happens to frames of one node to another.

use std::time::Duration;

/// How bad the network is in one direction; the default is perfect.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Impairment {
    /// Share of frames that are lost, each on its own.
    pub loss: f64,
    /// How late frames arrive, on the average.
    pub delay: Duration,
    /// How much earlier or later than that each of them may arrive, evenly distributed. Whichever is
    /// due first arrives first, so frames overtake each other.
    pub jitter: Duration,
    /// Nothing arrives.
    pub cut: bool,
}

impl Impairment {
    /// This share of frames is lost.
    #[must_use]
    pub fn loss(share: f64) -> Self {
        Self { loss: share, ..Self::default() }
    }

    /// Frames arrive this much later, give or take the jitter.
    #[must_use]
    pub fn delay(delay: Duration, jitter: Duration) -> Self {
        Self { delay, jitter, ..Self::default() }
    }

    /// Nothing arrives.
    #[must_use]
    pub fn cut() -> Self {
        Self { cut: true, ..Self::default() }
    }

    /// What becomes of a frame, given two random numbers in \[0, 1).
    pub(super) fn fate(&self, for_loss: f64, for_jitter: f64) -> Fate {
        if self.cut {
            Fate::Cut
        } else if for_loss < self.loss {
            Fate::Lost
        } else {
            let jitter = self.jitter.mul_f64(2.0 * for_jitter);
            Fate::Forwarded { after: (self.delay + jitter).saturating_sub(self.jitter) }
        }
    }
}

/// What becomes of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fate {
    /// It arrives so much later.
    Forwarded { after: Duration },
    /// It is lost by chance.
    Lost,
    /// There is no way.
    Cut,
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_perfect_network_forwards_at_once() {
        let fate = Impairment::default().fate(0.0, 0.99);
        assert_eq!(fate, Fate::Forwarded { after: Duration::ZERO });
    }

    #[test]
    fn jitter_goes_both_ways_and_never_before_now() {
        let after = |impairment: Impairment, number| match impairment.fate(0.5, number) {
            Fate::Forwarded { after } => after,
            other => panic!("{other:?}"),
        };
        let usual = Impairment::delay(20 * MS, 10 * MS);
        assert_eq!(after(usual, 0.0), 10 * MS);
        assert_eq!(after(usual, 0.5), 20 * MS);
        assert_eq!(after(usual, 0.75), 25 * MS);
        assert_eq!(after(Impairment::delay(MS, 10 * MS), 0.1), Duration::ZERO);
    }

    #[test]
    fn a_cut_comes_before_chance() {
        let both = Impairment { loss: 1.0, ..Impairment::cut() };
        assert_eq!(both.fate(0.0, 0.0), Fate::Cut);
        assert_eq!(Impairment::loss(1.0).fate(0.999, 0.0), Fate::Lost);
    }
}
