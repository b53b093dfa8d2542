//! The pause of sample processing while this module's own queries to peers are pending.

use std::collections::BTreeMap;
use std::time::Duration;

use tokio::time::Instant;
use vocabulary::ModuleName;

/// The pending queries, and whether samples wait for any of them.
#[derive(Debug)]
pub(crate) struct QueryPause {
    /// Of each peer, how many queries are pending.
    pending: BTreeMap<ModuleName, usize>,
    /// The peers that samples wait for. One that has let the time limit pass is not waited for again until it has no
    /// query pending: a slow peer delays no samples, and takes nothing from those that answer.
    awaited: Vec<ModuleName>,
    until: Option<Instant>,
    limit: Duration,
}

impl QueryPause {
    /// Samples wait for `limit` at most.
    pub(crate) fn new(limit: Duration) -> Self {
        Self { pending: BTreeMap::new(), awaited: Vec::new(), until: None, limit }
    }

    /// Samples wait until then.
    pub(crate) fn until(&self) -> Option<Instant> {
        self.until
    }

    /// A query to a peer begins.
    pub(crate) fn begin(&mut self, peer: &ModuleName) {
        let pending = self.pending.entry(peer.clone()).or_default();
        *pending += 1;
        if *pending == 1 {
            self.awaited.push(peer.clone());
            self.until.get_or_insert(Instant::now() + self.limit);
        }
    }

    /// A query to a peer ended.
    pub(crate) fn end(&mut self, peer: &ModuleName) {
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

    /// The time limit has passed.
    pub(crate) fn expire(&mut self) {
        self.until = None;
        self.awaited.clear();
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
        pause.begin(&one);
        let until = pause.until();
        pause.begin(&other);
        pause.begin(&other);
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
        pause.begin(&slow);
        pause.expire();
        pause.begin(&slow);
        assert_eq!(pause.until(), None, "it is not waited for twice");
        pause.begin(&quick);
        assert!(pause.until().is_some());
        pause.end(&quick);
        assert_eq!(pause.until(), None, "nor does it prolong the pause");
        pause.end(&slow);
        pause.end(&slow);
        pause.begin(&slow);
        assert!(pause.until().is_some());
    }
}
