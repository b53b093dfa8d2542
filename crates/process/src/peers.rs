//! Queries to peers: samples pause while queries are pending, timeouts grow after late answers, and failed queries are
//! repeated.

use std::collections::BTreeMap;
use std::iter::successors;
use std::time::{Duration, Instant};

use diagnosis::PeerFailure;
use vocabulary::{ModuleName, delivery::Backoff};

/// The pause of sample processing while queries to peers are pending: the pending queries, and whether samples wait for
/// any of them.
#[derive(Debug)]
pub struct QueryPause {
    /// The number of pending queries of each peer.
    pending: BTreeMap<ModuleName, usize>,
    /// The peers that samples wait for. After a peer exceeds the time limit, samples do not wait for it until it has no
    /// pending query, so that a slow peer neither delays samples nor shortens the wait for peers that answer.
    awaited: Vec<ModuleName>,
    until: Option<Instant>,
    limit: Duration,
}

impl QueryPause {
    /// Samples wait at most `limit`.
    #[must_use]
    pub fn new(limit: Duration) -> Self {
        Self { pending: BTreeMap::new(), awaited: Vec::new(), until: None, limit }
    }

    /// The end of the pause.
    #[must_use]
    pub fn until(&self) -> Option<Instant> {
        self.until
    }

    /// Records the start of a query to a peer.
    pub fn begin(&mut self, peer: &ModuleName, now: Instant) {
        let pending = self.pending.entry(peer.clone()).or_default();
        *pending += 1;
        if *pending == 1 {
            self.awaited.push(peer.clone());
            self.until.get_or_insert(now + self.limit);
        }
    }

    /// Records the end of a query to a peer.
    pub fn end(&mut self, peer: &ModuleName) {
        let Some(pending) = self.pending.get_mut(peer) else { return };
        *pending -= 1;
        if *pending == 0 {
            self.pending.remove(peer);
            self.awaited.retain(|awaited| awaited != peer);
            if self.awaited.is_empty() {
                self.until = None;
            }
        }
    }

    /// Records that the time limit has passed.
    pub fn expire(&mut self) {
        self.until = None;
        self.awaited.clear();
    }
}

/// The first pause before a failed query to a peer is repeated.
const FIRST_RETRY: Duration = Duration::from_millis(150);
/// The longest such pause.
const LONGEST_RETRY: Duration = Duration::from_millis(800);

/// The peers whose latest query failed, and when each is queried again. Times are by the clock, because steps pass
/// quickly while missed samples are recovered, and stop when samples stop.
#[derive(Debug, Default)]
pub struct PeerRetries(BTreeMap<ModuleName, RetryWait>);

#[derive(Debug, Clone, Copy)]
struct RetryWait {
    pauses: Backoff<Duration>,
    pause: Duration,
    until: Instant,
}

impl PeerRetries {
    /// Records the end of a query to the peer.
    pub fn note(&mut self, peer: &ModuleName, answered: bool, now: Instant) {
        if answered {
            self.0.remove(peer);
            return;
        }
        let known = self.0.get(peer).map(|wait| wait.pauses);
        let mut pauses = known.unwrap_or(Backoff::new(FIRST_RETRY, LONGEST_RETRY));
        let pause = pauses.fail();
        self.0.insert(peer.clone(), RetryWait { pauses, pause, until: now + pause });
    }

    /// The peers that may be queried again; each is returned once per pause.
    pub fn over(&mut self, now: Instant) -> Vec<ModuleName> {
        let mut over = Vec::new();
        for (peer, wait) in &mut self.0 {
            if wait.until <= now {
                wait.until = now + wait.pause;
                over.push(peer.clone());
            }
        }
        over
    }
}

/// The number of different timeouts; each is twice the previous one.
const TIMEOUTS: usize = 3;

/// The timeouts of queries: longer after each timeout, until the peer answers.
///
/// Over a link that loses packets an answer is late rather than lost: TCP repeats a lost packet after a quarter of a
/// second, and doubles that time with each further loss. With a constant timeout, answers could repeatedly arrive just
/// after their queries timed out.
#[derive(Debug)]
pub struct PeerTimeouts {
    first: Duration,
    /// The timeouts of peers that have timed out since they last answered or refused.
    longer: BTreeMap<ModuleName, Duration>,
}

impl PeerTimeouts {
    /// `first` is the timeout for a peer that answers.
    #[must_use]
    pub fn new(first: Duration) -> Self {
        Self { first, longer: BTreeMap::new() }
    }

    /// All timeouts, shortest first.
    pub fn all(&self) -> impl Iterator<Item = Duration> + use<> {
        successors(Some(self.first), |timeout| Some(2 * *timeout)).take(TIMEOUTS)
    }

    /// The timeout of the next query to the peer.
    #[must_use]
    pub fn of_next(&self, peer: &ModuleName) -> Duration {
        self.longer.get(peer).copied().unwrap_or(self.first)
    }

    /// Records the end of a query with this timeout. A refusal counts as an answer in time. The absence of a peer says
    /// nothing about how long its answers take.
    pub fn note(&mut self, peer: &ModuleName, timeout: Duration, failure: Option<&PeerFailure>) {
        match failure {
            Some(PeerFailure::TimedOut) => self.lengthen(peer, timeout),
            Some(PeerFailure::Absent) => {}
            Some(PeerFailure::Refused(_) | PeerFailure::Malformed(_)) | None => {
                self.longer.remove(peer);
            }
        }
    }

    /// Queries that were pending at the same time and timed out together count as one.
    fn lengthen(&mut self, peer: &ModuleName, timeout: Duration) {
        let next = self.all().find(|longer| *longer > timeout).unwrap_or(timeout);
        let of_peer = self.longer.entry(peer.clone()).or_insert(next);
        *of_peer = next.max(*of_peer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pause() -> (QueryPause, ModuleName, ModuleName) {
        (QueryPause::new(Duration::from_secs(1)), "slow".parse().unwrap(), "quick".parse().unwrap())
    }

    #[test]
    fn samples_wait_until_every_peer_has_answered() {
        let (mut pause, one, other) = pause();
        pause.begin(&one, Instant::now());
        let until = pause.until();
        pause.begin(&other, Instant::now());
        pause.begin(&other, Instant::now());
        assert!(until.is_some() && pause.until() == until, "the first query sets the limit");
        for peer in [&one, &other] {
            pause.end(peer);
            assert_eq!(pause.until(), until);
        }
        pause.end(&other);
        assert_eq!(pause.until(), None);
    }

    #[test]
    fn a_peer_that_does_not_answer_takes_the_pause_from_no_other_one() {
        let (mut pause, slow, quick) = pause();
        pause.begin(&slow, Instant::now());
        pause.expire();
        pause.begin(&slow, Instant::now());
        assert_eq!(pause.until(), None, "it is not waited for twice");
        pause.begin(&quick, Instant::now());
        assert!(pause.until().is_some());
        pause.end(&quick);
        assert_eq!(pause.until(), None, "nor does it prolong the pause");
        pause.end(&slow);
        pause.end(&slow);
        pause.begin(&slow, Instant::now());
        assert!(pause.until().is_some());
    }

    #[test]
    fn waits_grow_with_each_failure_and_end_with_an_answer() {
        let peer: ModuleName = "m2".parse().unwrap();
        let mut backoff = PeerRetries::default();
        let start = Instant::now();
        backoff.note(&peer, false, start);
        assert!(backoff.over(start + FIRST_RETRY / 2).is_empty());
        assert_eq!(backoff.over(start + FIRST_RETRY).as_slice(), std::slice::from_ref(&peer));
        backoff.note(&peer, false, start + FIRST_RETRY);
        assert!(backoff.over(start + 2 * FIRST_RETRY).is_empty());
        assert_eq!(backoff.over(start + 3 * FIRST_RETRY).as_slice(), std::slice::from_ref(&peer));
        backoff.note(&peer, true, start + 3 * FIRST_RETRY);
        assert!(backoff.over(start + 100 * FIRST_RETRY).is_empty());
    }

    const FIRST: Duration = Duration::from_millis(300);

    fn peer(name: &str) -> ModuleName {
        name.parse().unwrap()
    }

    /// Ends a question to the peer with the timeout that it got.
    fn end(timeouts: &mut PeerTimeouts, peer: &ModuleName, failure: Option<&PeerFailure>) {
        let timeout = timeouts.of_next(peer);
        timeouts.note(peer, timeout, failure);
    }

    #[test]
    fn timeouts_grow_with_each_failure_up_to_the_longest() {
        let (mut timeouts, peer) = (PeerTimeouts::new(FIRST), peer("m2"));
        assert_eq!(timeouts.all().collect::<Vec<_>>(), [FIRST, 2 * FIRST, 4 * FIRST]);
        for factor in [1, 2, 4, 4] {
            assert_eq!(timeouts.of_next(&peer), factor * FIRST);
            end(&mut timeouts, &peer, Some(&PeerFailure::TimedOut));
        }
    }

    #[test]
    fn what_comes_in_time_resets_the_timeout_and_absence_leaves_it() {
        let (mut timeouts, peer) = (PeerTimeouts::new(FIRST), peer("m2"));
        let refused = PeerFailure::Refused("no sample yet".into());
        let malformed = PeerFailure::Malformed("rubbish".into());
        for in_time in [None, Some(&refused), Some(&malformed)] {
            end(&mut timeouts, &peer, Some(&PeerFailure::TimedOut));
            end(&mut timeouts, &peer, Some(&PeerFailure::Absent));
            assert_eq!(timeouts.of_next(&peer), 2 * FIRST);
            end(&mut timeouts, &peer, in_time);
            assert_eq!(timeouts.of_next(&peer), FIRST);
        }
    }

    #[test]
    fn each_peer_has_a_timeout_of_its_own() {
        let mut timeouts = PeerTimeouts::new(FIRST);
        let [slow, quick] = ["m2", "m3"].map(peer);
        end(&mut timeouts, &slow, Some(&PeerFailure::TimedOut));
        end(&mut timeouts, &quick, None);
        assert_eq!((timeouts.of_next(&slow), timeouts.of_next(&quick)), (2 * FIRST, FIRST));
    }

    #[test]
    fn questions_that_time_out_together_lengthen_the_timeout_once() {
        let (mut timeouts, peer) = (PeerTimeouts::new(FIRST), peer("m2"));
        for _ in 0..3 {
            timeouts.note(&peer, FIRST, Some(&PeerFailure::TimedOut));
        }
        assert_eq!(timeouts.of_next(&peer), 2 * FIRST);
        end(&mut timeouts, &peer, Some(&PeerFailure::TimedOut));
        timeouts.note(&peer, FIRST, Some(&PeerFailure::TimedOut));
        assert_eq!(timeouts.of_next(&peer), 4 * FIRST);
    }
}
