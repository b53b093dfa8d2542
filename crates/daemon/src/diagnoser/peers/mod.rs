//! The peers: each as this module sees it (`PeerTable`), whether it is there (`presence`), what it answers (`queries`), its forces
//! while a gage is replaced (`forces`), and what its cylinders can do (`cylinders`).

mod cylinders;
mod forces;
mod presence;
mod queries;

use std::sync::Arc;

use diagnosis::PeerFailure;
use parking_lot::{Mutex, MutexGuard};
use vocabulary::{ModuleName, PeerOutcome, PeerStatus};

pub(crate) use cylinders::{SharedInterlock, watch_cylinders};
pub(crate) use forces::PeerForces;
pub(crate) use presence::{LOOK_EVERY, Presence, watch};
pub(crate) use queries::PeerQueries;

/// The peers, in the order of the configuration.
#[derive(Debug, Clone)]
pub(crate) struct PeerTable(Arc<Mutex<Vec<PeerStatus>>>);

impl PeerTable {
    pub(crate) fn new(peers: &[ModuleName]) -> Self {
        let peers = peers.iter().cloned().map(PeerStatus::unasked).collect();
        Self(Arc::new(Mutex::new(peers)))
    }

    /// A peer's token came or went.
    pub(crate) fn note_presence(&self, peer: &ModuleName, present: bool) {
        self.change(peer, |status| status.present = present);
    }

    /// Is the peer's token there?
    pub(crate) fn is_present(&self, peer: &ModuleName) -> bool {
        self.peers().iter().any(|status| status.module == *peer && status.present)
    }

    /// A question to a peer ended.
    pub(crate) fn note_outcome(&self, peer: &ModuleName, failure: Option<&PeerFailure>) {
        self.change(peer, |status| {
            let (outcome, counter) = match failure {
                None => (PeerOutcome::Answered, &mut status.answered),
                Some(PeerFailure::Refused(_)) => (PeerOutcome::Refused, &mut status.refused),
                Some(PeerFailure::TimedOut) => (PeerOutcome::TimedOut, &mut status.timed_out),
                Some(PeerFailure::Absent) => (PeerOutcome::Absent, &mut status.absent),
                Some(PeerFailure::Malformed(_)) => (PeerOutcome::Malformed, &mut status.malformed),
            };
            *counter += 1;
            status.latest = Some(outcome);
            status.reason = match failure {
                Some(PeerFailure::Refused(reason) | PeerFailure::Malformed(reason)) => {
                    Some(reason.clone())
                }
                _ => None,
            };
        });
    }

    /// An answer that was well-formed does not fit what the peer was asked, or said before.
    pub(crate) fn note_rejection(&self, peer: &ModuleName, reason: String) {
        self.change(peer, |status| {
            status.answered = status.answered.saturating_sub(1);
            status.malformed += 1;
            status.latest = Some(PeerOutcome::Malformed);
            status.reason = Some(reason);
        });
    }

    /// A peer did not stand by what it said.
    pub(crate) fn note_dispute(&self, peer: &ModuleName) {
        self.change(peer, |status| status.disputed += 1);
    }

    /// Why a peer has not answered so far.
    pub(crate) fn why_silent(&self, peer: &ModuleName) -> String {
        let peers = self.peers();
        let status = peers.iter().find(|status| status.module == *peer);
        let reason = status.and_then(|status| status.reason.clone()).unwrap_or_default();
        match status.and_then(|status| status.latest) {
            Some(PeerOutcome::Refused) => format!("refused: {reason}"),
            Some(PeerOutcome::Malformed) => format!("invalid answer: {reason}"),
            Some(PeerOutcome::TimedOut) => "no answer in time".to_owned(),
            Some(PeerOutcome::Absent) => "it is not there".to_owned(),
            Some(PeerOutcome::Answered) | None => "no answer yet".to_owned(),
        }
    }

    pub(crate) fn read(&self) -> Vec<PeerStatus> {
        self.peers().clone()
    }

    fn change(&self, peer: &ModuleName, change: impl FnOnce(&mut PeerStatus)) {
        if let Some(status) = self.peers().iter_mut().find(|status| status.module == *peer) {
            change(status);
        }
    }

    fn peers(&self) -> MutexGuard<'_, Vec<PeerStatus>> {
        self.0.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_are_distinguished() {
        let peer: ModuleName = "m2".parse().unwrap();
        let table = PeerTable::new(std::slice::from_ref(&peer));
        let failures = [
            None,
            Some(PeerFailure::TimedOut),
            Some(PeerFailure::Absent),
            Some(PeerFailure::Malformed("rubbish".into())),
            Some(PeerFailure::Refused("no sample yet".into())),
        ];
        let why = failures.iter().map(|failure| {
            table.note_outcome(&peer, failure.as_ref());
            table.why_silent(&peer)
        });
        let expected = [
            "no answer yet",
            "no answer in time",
            "it is not there",
            "invalid answer: rubbish",
            "refused: no sample yet",
        ];
        assert_eq!(why.collect::<Vec<_>>(), expected);
        table.note_presence(&peer, true);
        table.note_dispute(&peer);
        let status = table.read().remove(0);
        let counts =
            [status.answered, status.refused, status.timed_out, status.absent, status.malformed];
        assert_eq!((counts, status.disputed, status.present), ([1; 5], 1, true));
        assert_eq!(status.latest, Some(PeerOutcome::Refused));
        assert_eq!(status.reason.as_deref(), Some("no sample yet"));
    }

    #[test]
    fn an_answer_that_contradicts_a_former_one_counts_as_none() {
        let peer: ModuleName = "m2".parse().unwrap();
        let table = PeerTable::new(std::slice::from_ref(&peer));
        table.note_outcome(&peer, None);
        table.note_rejection(&peer, "no such change before".to_owned());
        let status = table.read().remove(0);
        assert_eq!((status.answered, status.malformed), (0, 1));
        assert_eq!(table.why_silent(&peer), "invalid answer: no such change before");
    }
}
