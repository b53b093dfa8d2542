//! When a peer that did not answer is asked again: by the clock, for the diagnoser counts in steps, and
//! these fly while missed samples are made up for and stand still when samples stop.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use truss::ids::ModuleName;

const FIRST: Duration = Duration::from_millis(150);
const LONGEST: Duration = Duration::from_millis(800);

/// The peers whose latest question failed.
#[derive(Debug, Default)]
pub(crate) struct Patience(BTreeMap<ModuleName, Wait>);

#[derive(Debug, Clone, Copy)]
struct Wait {
    until: Instant,
    length: Duration,
}

impl Patience {
    /// A question to the peer ended.
    pub(crate) fn note(&mut self, peer: &ModuleName, answered: bool, now: Instant) {
        if answered {
            self.0.remove(peer);
            return;
        }
        let length = self.0.get(peer).map_or(FIRST, |wait| (2 * wait.length).min(LONGEST));
        self.0.insert(peer.clone(), Wait { until: now + length, length });
    }

    /// The peers that may be asked again; each is told once for each failure.
    pub(crate) fn over(&mut self, now: Instant) -> Vec<ModuleName> {
        let mut over = Vec::new();
        for (peer, wait) in &mut self.0 {
            if wait.until <= now {
                wait.until = now + wait.length;
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
        let mut patience = Patience::default();
        let start = Instant::now();
        patience.note(&peer, false, start);
        assert!(patience.over(start + FIRST / 2).is_empty());
        assert_eq!(patience.over(start + FIRST).as_slice(), std::slice::from_ref(&peer));
        patience.note(&peer, false, start + FIRST);
        assert!(patience.over(start + 2 * FIRST).is_empty());
        assert_eq!(patience.over(start + 3 * FIRST).as_slice(), std::slice::from_ref(&peer));
        patience.note(&peer, true, start + 3 * FIRST);
        assert!(patience.over(start + 100 * FIRST).is_empty());
    }
}
