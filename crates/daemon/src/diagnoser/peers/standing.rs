//! Each peer as this module sees it.

use std::sync::Arc;

use diagnosis::PeerFailure;
use parking_lot::{Mutex, MutexGuard};
use vocabulary::{ModuleName, PeerOutcome, PeerStatus};

/// The peers, in the order of the configuration.
#[derive(Debug, Clone)]
pub(crate) struct PeerBook(Arc<Mutex<Vec<PeerStatus>>>);

impl PeerBook {
    pub(crate) fn new(peers: &[ModuleName]) -> Self {
        let pages = peers.iter().cloned().map(PeerStatus::unasked).collect();
        Self(Arc::new(Mutex::new(pages)))
    }

    /// A peer's token came or went.
    pub(crate) fn note_presence(&self, peer: &ModuleName, present: bool) {
        self.change(peer, |page| page.present = present);
    }

    /// Is the peer's token there?
    pub(crate) fn is_present(&self, peer: &ModuleName) -> bool {
        self.pages().iter().any(|page| page.module == *peer && page.present)
    }

    /// A question to a peer ended.
    pub(crate) fn note_outcome(&self, peer: &ModuleName, failure: Option<&PeerFailure>) {
        self.change(peer, |page| {
            let (outcome, counter) = match failure {
                None => (PeerOutcome::Answered, &mut page.answered),
                Some(PeerFailure::Refused(_)) => (PeerOutcome::Refused, &mut page.refused),
                Some(PeerFailure::TimedOut) => (PeerOutcome::TimedOut, &mut page.timed_out),
                Some(PeerFailure::Absent) => (PeerOutcome::Absent, &mut page.absent),
                Some(PeerFailure::Malformed(_)) => (PeerOutcome::Malformed, &mut page.malformed),
            };
            *counter += 1;
            page.latest = Some(outcome);
            page.reason = match failure {
                Some(PeerFailure::Refused(reason) | PeerFailure::Malformed(reason)) => {
                    Some(reason.clone())
                }
                _ => None,
            };
        });
    }

    /// An answer that was well-formed does not fit what the peer was asked, or said before.
    pub(crate) fn note_rejection(&self, peer: &ModuleName, reason: String) {
        self.change(peer, |page| {
            page.answered = page.answered.saturating_sub(1);
            page.malformed += 1;
            page.latest = Some(PeerOutcome::Malformed);
            page.reason = Some(reason);
        });
    }

    /// A peer did not stand by what it said.
    pub(crate) fn note_dispute(&self, peer: &ModuleName) {
        self.change(peer, |page| page.disputed += 1);
    }

    /// Why a peer has not answered so far.
    pub(crate) fn why_silent(&self, peer: &ModuleName) -> String {
        let pages = self.pages();
        let page = pages.iter().find(|page| page.module == *peer);
        let reason = page.and_then(|page| page.reason.clone()).unwrap_or_default();
        match page.and_then(|page| page.latest) {
            Some(PeerOutcome::Refused) => format!("it refuses: {reason}"),
            Some(PeerOutcome::Malformed) => format!("its answer does not count: {reason}"),
            Some(PeerOutcome::TimedOut) => "no answer in time".to_owned(),
            Some(PeerOutcome::Absent) => "it is not there".to_owned(),
            Some(PeerOutcome::Answered) | None => "no answer yet".to_owned(),
        }
    }

    pub(crate) fn read(&self) -> Vec<PeerStatus> {
        self.pages().clone()
    }

    fn change(&self, peer: &ModuleName, change: impl FnOnce(&mut PeerStatus)) {
        if let Some(page) = self.pages().iter_mut().find(|page| page.module == *peer) {
            change(page);
        }
    }

    /// Pages are changed one field at a time, each of them valid by itself.
    fn pages(&self) -> MutexGuard<'_, Vec<PeerStatus>> {
        self.0.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_are_distinguished() {
        let peer: ModuleName = "m2".parse().unwrap();
        let book = PeerBook::new(std::slice::from_ref(&peer));
        let failures = [
            None,
            Some(PeerFailure::TimedOut),
            Some(PeerFailure::Absent),
            Some(PeerFailure::Malformed("rubbish".into())),
            Some(PeerFailure::Refused("no sample yet".into())),
        ];
        let why = failures.iter().map(|failure| {
            book.note_outcome(&peer, failure.as_ref());
            book.why_silent(&peer)
        });
        let expected = [
            "no answer yet",
            "no answer in time",
            "it is not there",
            "its answer does not count: rubbish",
            "it refuses: no sample yet",
        ];
        assert_eq!(why.collect::<Vec<_>>(), expected);
        book.note_presence(&peer, true);
        book.note_dispute(&peer);
        let page = book.read().remove(0);
        let counts = [page.answered, page.refused, page.timed_out, page.absent, page.malformed];
        assert_eq!((counts, page.disputed, page.present), ([1; 5], 1, true));
        assert_eq!(page.latest, Some(PeerOutcome::Refused));
        assert_eq!(page.reason.as_deref(), Some("no sample yet"));
    }

    #[test]
    fn an_answer_that_contradicts_a_former_one_counts_as_none() {
        let peer: ModuleName = "m2".parse().unwrap();
        let book = PeerBook::new(std::slice::from_ref(&peer));
        book.note_outcome(&peer, None);
        book.note_rejection(&peer, "no such change before".to_owned());
        let page = book.read().remove(0);
        assert_eq!((page.answered, page.malformed), (0, 1));
        assert_eq!(book.why_silent(&peer), "its answer does not count: no such change before");
    }
}
