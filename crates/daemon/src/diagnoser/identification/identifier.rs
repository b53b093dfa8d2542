//! Identifies faults, their kind and size, on a thread of its own: it takes milliseconds, for which the diagnosis does not
//! wait.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Instant;

use diagnosis::identification::{Excerpt, identify};
use shell::clock;
use shell::occurrences::Occurrences;

use super::IdentificationTally;
use crate::convert::Speaker;
use crate::diagnoser::outgoing::{Outbox, Outgoing};

/// Requests that may wait. Each is superseded by the next one of its component.
const WAITING: usize = 64;

/// The thread's queue.
#[derive(Debug)]
pub(crate) struct Identifier {
    queue: SyncSender<Box<Excerpt>>,
    tally: Arc<IdentificationTally>,
    turned_away: Occurrences,
    ended: Occurrences,
}

impl Identifier {
    /// Starts the thread, which hands what it finds to the outbox. It ends with this.
    ///
    /// # Errors
    /// The system has no thread.
    pub(crate) fn start(
        speaker: Speaker,
        outbox: Outbox,
        tally: Arc<IdentificationTally>,
    ) -> std::io::Result<Self> {
        let (queue, requests) = sync_channel(WAITING);
        let thread = std::thread::Builder::new().name("identifier".to_owned());
        let worker = Worker { speaker, outbox, tally: Arc::clone(&tally) };
        thread.spawn(move || worker.run(&requests))?;
        Ok(Self {
            queue,
            tally,
            turned_away: Occurrences::default(),
            ended: Occurrences::default(),
        })
    }

    /// Hands in a request without waiting.
    pub(crate) fn identify(&mut self, excerpt: Box<Excerpt>) {
        match self.queue.try_send(excerpt) {
            Ok(()) => {}
            Err(TrySendError::Full(excerpt)) => {
                self.tally.turned_away();
                if let Some(times) = self.turned_away.note() {
                    let component = &excerpt.component;
                    tracing::warn!(%component, times, "fault not identified: too many at once");
                }
            }
            Err(TrySendError::Disconnected(excerpt)) => {
                self.tally.failed();
                if let Some(times) = self.ended.note() {
                    let component = &excerpt.component;
                    tracing::error!(%component, times, "fault not identified: the thread that \
                        identifies faults has ended; restart this process");
                }
            }
        }
    }
}

/// What the thread owns.
struct Worker {
    speaker: Speaker,
    outbox: Outbox,
    tally: Arc<IdentificationTally>,
}

impl Worker {
    fn run(&self, requests: &Receiver<Box<Excerpt>>) {
        while let Ok(excerpt) = requests.recv() {
            self.identify(&excerpt);
        }
    }

    /// A request that fails is logged and counted, and ends nothing else: the next one may be of another component.
    fn identify(&self, excerpt: &Excerpt) {
        let begun = Instant::now();
        match catch_unwind(AssertUnwindSafe(|| identify(excerpt))) {
            Ok(found) => {
                self.tally.done(begun.elapsed());
                let message = self.speaker.identification(found, clock::unix_ns());
                // Without room for it the next one tells the same.
                self.outbox.event(Outgoing::Identification(Box::new(message)));
            }
            Err(_) => {
                self.tally.failed();
                let component = &excerpt.component;
                tracing::error!(%component, "fault not identified: the computation has failed");
            }
        }
    }
}
