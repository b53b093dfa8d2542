//! Replies to those who ask what is known at present, on a thread of its own: neither the disk nor an asker who reads
//! slowly comes between.

use std::sync::Arc;
use std::sync::mpsc::Receiver;

use shell::supervision::Lane;
use tokio::sync::OwnedSemaphorePermit;
use vocabulary::{Key, Message, Topic};
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::query::Query;

use super::books::SharedBooks;
use crate::diagnoser::inquiry::InquiryTally;
use crate::diagnoser::state::JournalBoard;
use crate::messages::put;

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Wanted {
    /// The state of each component.
    States,
    /// Of each faulty component, what its fault is.
    Identifications,
    /// The phase of the module.
    Phase,
}

/// A question.
#[derive(Debug)]
pub(crate) struct Asked {
    pub(crate) wanted: Wanted,
    pub(crate) query: Query,
    /// Its place among those that may wait; free when the question is done with.
    pub(crate) place: OwnedSemaphorePermit,
}

/// What the thread owns.
pub(crate) struct ReplyLane {
    books: SharedBooks,
    journal: JournalBoard,
    inquiries: Arc<InquiryTally>,
}

impl ReplyLane {
    pub(crate) fn new(
        books: SharedBooks,
        journal: JournalBoard,
        inquiries: Arc<InquiryTally>,
    ) -> Self {
        Self { books, journal, inquiries }
    }

    /// Replies until nobody can ask any more.
    pub(crate) fn run(&self, queue: &Receiver<Asked>, lane: &Lane) {
        while let Ok(Asked { wanted, query, place }) = queue.recv() {
            lane.begin();
            match wanted {
                Wanted::States => self.states(&query),
                Wanted::Identifications => self.identifications(&query),
                Wanted::Phase => self.phase(&query),
            }
            self.inquiries.answered();
            drop(place);
            lane.rest();
        }
    }

    /// What the disk did not have in time when it was published, it may have by now.
    fn states(&self, query: &Query) {
        let states = self.books.lock().states_at(query.key_expr());
        // After the states: what was handed in by then includes them.
        let has_all = self.journal.has_all();
        for (key, mut state) in states {
            state.durable |= has_all;
            reply(query, &key, &state);
        }
    }

    fn identifications(&self, query: &Query) {
        let found = self.books.lock().identifications_at(query.key_expr());
        for (key, found) in found {
            reply(query, &key, &found);
        }
    }

    /// On the module's own key, for queries to every module at once.
    fn phase(&self, query: &Query) {
        let phase = self.books.lock().phase.clone();
        if let Some(change) = phase {
            let key = Key::of_module(&change.structure, &change.module, Topic::Phase);
            reply(query, &key.to_string(), &change);
        }
    }
}

fn reply<M: Message>(query: &Query, key: &str, message: &M) {
    put(message, |bytes| query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait());
}
