//! Identifies faults, their kind and size, on a thread of its own: it takes milliseconds, for which the diagnosis does not
//! wait.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

use diagnosis::identification::{Excerpt, IdentificationResult, identify_in_pieces};
use shell::clock;
use shell::runtime::contained;
use shell::supervision::{Crew, Lane};
use vocabulary::Component;
use vocabulary::Occurrences;

use super::publish::{ModuleOutbox, OutgoingEvent};
use crate::counters::SharedCounters;
pub(crate) use crate::metrics::IdentificationReport;
use diagnosis::messages::Speaker;

/// Requests that may wait. Each is superseded by the next one of its component.
const WAITING: usize = 64;

/// The kernel lets a thread go on for some milliseconds although others have something to do; this one, no longer than that.
const PIECE: Duration = Duration::from_micros(200);

thread_local! {
    /// When the thread last let others go first.
    static YIELDED: Cell<Option<Instant>> = const { Cell::new(None) };
}

/// The thread's queue.
#[derive(Debug)]
pub(crate) struct Identifier {
    queue: SyncSender<Box<Excerpt>>,
    tally: Arc<SharedCounters<IdentificationReport>>,
    turned_away: Occurrences,
}

impl Identifier {
    /// Starts the thread, which hands what it finds to the outbox. It ends with this.
    ///
    /// # Errors
    /// The system has no thread.
    pub(crate) fn start(
        speaker: Speaker,
        outbox: ModuleOutbox,
        tally: Arc<SharedCounters<IdentificationReport>>,
        crew: &Crew,
    ) -> std::io::Result<Self> {
        let (queue, requests) = sync_channel(WAITING);
        let worker = Worker { speaker, outbox, tally: Arc::clone(&tally) };
        crew.thread("identifier", move |lane| worker.run(&requests, lane))?;
        Ok(Self { queue, tally, turned_away: Occurrences::default() })
    }

    /// Hands in a request without waiting.
    pub(crate) fn identify(&mut self, excerpt: Box<Excerpt>) {
        match self.queue.try_send(excerpt) {
            Ok(()) => {}
            Err(TrySendError::Full(excerpt)) => {
                self.tally.count(|counters| counters.turned_away += 1);
                if let Some(times) = self.turned_away.note(std::time::Instant::now()) {
                    let component = &excerpt.component;
                    tracing::warn!(%component, times, "identification skipped: queue full");
                }
            }
            // Its end ends the process.
            Err(TrySendError::Disconnected(_)) => {}
        }
    }
}

/// What the thread owns.
struct Worker {
    speaker: Speaker,
    outbox: ModuleOutbox,
    tally: Arc<SharedCounters<IdentificationReport>>,
}

impl Worker {
    fn run(&self, requests: &Receiver<Box<Excerpt>>, lane: &Lane) {
        while let Ok(excerpt) = requests.recv() {
            lane.begin();
            let identify = || identify_in_pieces(&excerpt, None, let_others_go_first);
            if let Some(found) = attempt(&self.tally, &excerpt.component, identify) {
                let message = self.speaker.identification(found, clock::unix_ns());
                // Without room for it the next one tells the same.
                self.outbox.event(OutgoingEvent::Identification(Box::new(message)));
            }
            lane.rest();
        }
    }
}

/// Samples, answers and verdicts go first, where all processors are busy.
fn let_others_go_first() {
    let is_due = YIELDED.get().is_none_or(|last| last.elapsed() > PIECE);
    if is_due {
        std::thread::yield_now();
        YIELDED.set(Some(Instant::now()));
    }
}

/// A panic costs this identification only: no state outlives it, and diagnosis goes on.
fn attempt(
    tally: &SharedCounters<IdentificationReport>,
    component: &Component,
    identify: impl FnOnce() -> IdentificationResult,
) -> Option<IdentificationResult> {
    let begun = Instant::now();
    match contained(identify) {
        Ok(found) => {
            let took = begun.elapsed();
            tally.count(|counters| {
                counters.done += 1;
                counters.took += took;
            });
            Some(found)
        }
        Err(reason) => {
            tally.count(|counters| counters.failed += 1);
            tracing::error!(%component, reason, "identification failed");
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    #[test]
    fn an_identification_that_panics_is_counted_and_the_next_one_is_carried_out() {
        let tally = SharedCounters::<IdentificationReport>::default();
        let component: Component = "sensor/g1".parse().unwrap();
        assert_eq!(attempt(&tally, &component, || panic!("on purpose")), None);
        let found = IdentificationResult {
            run: RunId(1),
            sequence: 1,
            component: component.clone(),
            as_of: Step(1),
            candidates: Vec::new(),
            signature: Vec::new(),
        };
        assert_eq!(attempt(&tally, &component, || found.clone()), Some(found.clone()));
        let report = tally.read();
        assert_eq!((report.failed, report.done), (1, 1));
    }
}
