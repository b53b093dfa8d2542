//! How long a peer's answer is waited for: longer after each question that timed out, until one is answered.
//!
//! Over a link that loses packets an answer is late rather than lost: TCP repeats a lost packet after a quarter of
//! a second, and after twice as long whenever that is lost as well. With the same timeout each time, answers could
//! come right after their questions were given up, again and again.

use std::collections::BTreeMap;
use std::iter::successors;
use std::sync::Arc;
use std::time::Duration;

use diagnosis::PeerFailure;
use parking_lot::{Mutex, MutexGuard};
use vocabulary::ModuleName;

/// How many different timeouts there are; each is twice the one before.
const TIMEOUTS: usize = 3;

/// The timeouts of the next questions.
#[derive(Debug, Clone)]
pub(super) struct Timeouts {
    first: Duration,
    /// Of the peers that have timed out since they last answered or refused.
    longer: Arc<Mutex<BTreeMap<ModuleName, Duration>>>,
}

impl Timeouts {
    /// `first` is the timeout of a peer that answers.
    pub(super) fn new(first: Duration) -> Self {
        Self { first, longer: Arc::default() }
    }

    /// All there are, shortest first.
    pub(super) fn all(&self) -> impl Iterator<Item = Duration> + use<> {
        successors(Some(self.first), |timeout| Some(2 * *timeout)).take(TIMEOUTS)
    }

    /// The timeout of the next question to the peer.
    pub(super) fn of_next(&self, peer: &ModuleName) -> Duration {
        self.longer().get(peer).copied().unwrap_or(self.first)
    }

    /// A question to the peer with this timeout ended. A refusal came in time as well. That a peer is absent says
    /// nothing of how long its answers take.
    pub(super) fn note(&self, peer: &ModuleName, timeout: Duration, failure: Option<&PeerFailure>) {
        match failure {
            Some(PeerFailure::TimedOut) => self.lengthen(peer, timeout),
            Some(PeerFailure::Absent) => {}
            Some(PeerFailure::Refused(_) | PeerFailure::Malformed(_)) | None => {
                self.longer().remove(peer);
            }
        }
    }

    /// Questions that were under way together and timed out together count as one.
    fn lengthen(&self, peer: &ModuleName, timeout: Duration) {
        let next = self.all().find(|longer| *longer > timeout).unwrap_or(timeout);
        let mut longer = self.longer();
        let of_peer = longer.entry(peer.clone()).or_insert(next);
        *of_peer = next.max(*of_peer);
    }

    /// Each peer's timeout is valid by itself.
    fn longer(&self) -> MutexGuard<'_, BTreeMap<ModuleName, Duration>> {
        self.longer.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIRST: Duration = Duration::from_millis(300);

    fn peer(name: &str) -> ModuleName {
        name.parse().unwrap()
    }

    /// Ends a question to the peer with the timeout that it got.
    fn end(timeouts: &Timeouts, peer: &ModuleName, failure: Option<&PeerFailure>) {
        timeouts.note(peer, timeouts.of_next(peer), failure);
    }

    #[test]
    fn timeouts_grow_with_each_failure_up_to_the_longest() {
        let (timeouts, peer) = (Timeouts::new(FIRST), peer("m2"));
        assert_eq!(timeouts.all().collect::<Vec<_>>(), [FIRST, 2 * FIRST, 4 * FIRST]);
        for factor in [1, 2, 4, 4] {
            assert_eq!(timeouts.of_next(&peer), factor * FIRST);
            end(&timeouts, &peer, Some(&PeerFailure::TimedOut));
        }
    }

    #[test]
    fn what_comes_in_time_resets_the_timeout_and_absence_leaves_it() {
        let (timeouts, peer) = (Timeouts::new(FIRST), peer("m2"));
        let refused = PeerFailure::Refused("no sample yet".into());
        let malformed = PeerFailure::Malformed("rubbish".into());
        for in_time in [None, Some(&refused), Some(&malformed)] {
            end(&timeouts, &peer, Some(&PeerFailure::TimedOut));
            end(&timeouts, &peer, Some(&PeerFailure::Absent));
            assert_eq!(timeouts.of_next(&peer), 2 * FIRST);
            end(&timeouts, &peer, in_time);
            assert_eq!(timeouts.of_next(&peer), FIRST);
        }
    }

    #[test]
    fn each_peer_has_a_timeout_of_its_own() {
        let timeouts = Timeouts::new(FIRST);
        let [slow, quick] = ["m2", "m3"].map(peer);
        end(&timeouts, &slow, Some(&PeerFailure::TimedOut));
        end(&timeouts, &quick, None);
        assert_eq!((timeouts.of_next(&slow), timeouts.of_next(&quick)), (2 * FIRST, FIRST));
    }

    #[test]
    fn questions_that_time_out_together_lengthen_the_timeout_once() {
        let (timeouts, peer) = (Timeouts::new(FIRST), peer("m2"));
        for _ in 0..3 {
            timeouts.note(&peer, FIRST, Some(&PeerFailure::TimedOut));
        }
        assert_eq!(timeouts.of_next(&peer), 2 * FIRST);
        end(&timeouts, &peer, Some(&PeerFailure::TimedOut));
        timeouts.note(&peer, FIRST, Some(&PeerFailure::TimedOut));
        assert_eq!(timeouts.of_next(&peer), 4 * FIRST);
    }
}
