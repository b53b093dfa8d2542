//! When a peer that did not answer is queried again: by the clock, because the diagnoser counts steps,
//! which race while missed samples are recovered and stop when samples stop.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::{ModuleName, delivery::Backoff};

const FIRST: Duration = Duration::from_millis(150);
const LONGEST: Duration = Duration::from_millis(800);

/// The peers whose latest query failed.
#[derive(Debug, Default)]
pub(crate) struct PeerRetries(BTreeMap<ModuleName, Wait>);

#[derive(Debug, Clone, Copy)]
struct Wait {
    pauses: Backoff<Duration>,
    pause: Duration,
    until: Instant,
}

impl PeerRetries {
    /// A query to the peer ended.
    pub(crate) fn note(&mut self, peer: &ModuleName, answered: bool, now: Instant) {
        if answered {
            self.0.remove(peer);
            return;
        }
        let known = self.0.get(peer).map(|wait| wait.pauses);
        let mut pauses = known.unwrap_or(Backoff::new(FIRST, LONGEST));
        let pause = pauses.fail();
        self.0.insert(peer.clone(), Wait { pauses, pause, until: now + pause });
    }

    /// The peers that may be queried again; each is returned once per wait.
    pub(crate) fn over(&mut self, now: Instant) -> Vec<ModuleName> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_grow_with_each_failure_and_end_with_an_answer() {
        let peer: ModuleName = "m2".parse().unwrap();
        let mut backoff = PeerRetries::default();
        let start = Instant::now();
        backoff.note(&peer, false, start);
        assert!(backoff.over(start + FIRST / 2).is_empty());
        assert_eq!(backoff.over(start + FIRST).as_slice(), std::slice::from_ref(&peer));
        backoff.note(&peer, false, start + FIRST);
        assert!(backoff.over(start + 2 * FIRST).is_empty());
        assert_eq!(backoff.over(start + 3 * FIRST).as_slice(), std::slice::from_ref(&peer));
        backoff.note(&peer, true, start + 3 * FIRST);
        assert!(backoff.over(start + 100 * FIRST).is_empty());
    }
}
