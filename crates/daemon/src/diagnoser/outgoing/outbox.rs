//! Takes what is to go out; never waits. What is to be stored goes to the journal at once, whatever the network does.
//! Three threads publish and reply: `event_lane` what must not be lost, `reply_lane` what is known at present to those
//! who ask, `routine_lane` the rest.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::time::Instant;

use shell::occurrences::Occurrences;
use shell::supervision::{Crew, Ended};
use tokio::sync::mpsc;
use vocabulary::PublisherCounters;

use super::books::SharedBooks;
use super::event_lane::{EventLane, Outgoing, Stored};
use super::reply_lane::{Asked, ReplyLane};
use super::routine_lane::{Audiences, Routine, RoutineLane};
use crate::diagnoser::state::{Record, Submission, Watch};

const QUEUE: usize = 8192;
/// Room that refusals leave to answers and status: malformed queries crowd nothing out.
const KEPT_FREE: usize = QUEUE - 1024;

#[derive(Debug, Default)]
struct OutboxTally {
    events: AtomicU64,
    events_lost: AtomicU64,
    replies_lost: AtomicU64,
    /// Lines on the events that were lost.
    losses: Occurrences,
}

/// The way out.
#[derive(Debug, Clone)]
pub(crate) struct Outbox {
    journal: Arc<Submission>,
    books: SharedBooks,
    events: SyncSender<Stored>,
    questions: SyncSender<Asked>,
    routine: mpsc::Sender<Routine>,
    /// The subscribers of frequent messages; without any, these need not be handed in.
    pub(crate) audiences: Audiences,
    tally: Arc<OutboxTally>,
}

/// What carries it.
pub(crate) struct Lanes {
    pub(crate) events: EventLane,
    pub(crate) replies: ReplyLane,
    pub(crate) routine: RoutineLane,
}

/// Signals that the threads have carried everything.
pub(crate) type Drained = Vec<Ended>;

impl Outbox {
    /// Starts the threads, which end when all outboxes are gone; so does the one that writes the journal.
    pub(crate) fn open(
        (journal, books): (Submission, SharedBooks),
        lanes: Lanes,
        crew: &Crew,
    ) -> std::io::Result<(Self, Drained)> {
        let Lanes { events, replies, routine } = lanes;
        let (events_in, events_out) = sync_channel(QUEUE);
        let (questions, questions_out) = sync_channel(QUEUE);
        let (routine_in, routine_out) = mpsc::channel(QUEUE);
        let audiences = routine.audiences();
        let drained = vec![
            crew.thread("events", move |lane| events.run(&events_out, lane))?,
            crew.thread("replies", move |lane| replies.run(&questions_out, lane))?,
            crew.thread("routine", move |lane| routine.run(routine_out, lane))?,
        ];
        let outbox = Self {
            journal: Arc::new(journal),
            books,
            events: events_in,
            questions,
            routine: routine_in,
            audiences,
            tally: Arc::default(),
        };
        Ok((outbox, drained))
    }

    /// Hands an event to the journal, then queues it for publishing. If the network has been stalled for so long that the
    /// queue is full, the event is dropped for subscribers and counted; queries still return it.
    pub(crate) fn event(&self, event: Outgoing) {
        // Held until it is in both queues, so that they have the same order whoever hands it in.
        let mut books = self.books.lock();
        let Some(event) = books.faults.note(event) else { return };
        if let Outgoing::Phase(change) = &event {
            books.phase = Some((**change).clone());
        }
        let ticket = self.journal.hand_in(event.to_record().into_iter().collect(), None);
        let is_reply = matches!(event, Outgoing::Obeyed { .. });
        self.tally.events.fetch_add(u64::from(!is_reply), Ordering::Relaxed);
        match self.events.try_send(Stored { event, ticket }) {
            Ok(()) => {}
            Err(TrySendError::Full(lost) | TrySendError::Disconnected(lost)) => {
                books.enter_lost(lost.event);
                self.count_loss(is_reply);
            }
        }
    }

    fn count_loss(&self, is_reply: bool) {
        let (lost, what) = match is_reply {
            true => (&self.tally.replies_lost, "reply"),
            false => (&self.tally.events_lost, "event"),
        };
        lost.fetch_add(1, Ordering::Relaxed);
        if let Some(times) = self.tally.losses.note(Instant::now()) {
            tracing::error!(times, "{what} dropped: outgoing queue full");
        }
    }

    /// Something for the journal only.
    pub(crate) fn record(&self, record: Record) {
        self.journal.hand_in(vec![record], None);
    }

    /// How far the module has watched: for the disk, after all before it.
    pub(crate) fn watched(&self, watch: Watch) {
        self.journal.hand_in(Vec::new(), Some(watch));
    }

    /// A question about what is known at present. Whether there was room.
    pub(crate) fn question(&self, asked: Asked) -> bool {
        self.questions.try_send(asked).is_ok()
    }

    /// Something that is dropped if there is no room; a reply is counted then.
    pub(crate) fn routine(&self, message: Routine) {
        let (reply, room) = match message {
            Routine::Refusal { .. } => (true, self.routine.capacity() > KEPT_FREE),
            Routine::Answer { .. } => (true, true),
            _ => (false, true),
        };
        let taken = room && self.routine.try_send(message).is_ok();
        if reply && !taken {
            self.tally.replies_lost.fetch_add(1, Ordering::Relaxed);
        }
    }

    pub(crate) fn counters(&self) -> PublisherCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        PublisherCounters {
            events: read(&self.tally.events),
            events_lost: read(&self.tally.events_lost),
            replies_lost: read(&self.tally.replies_lost),
        }
    }
}

#[cfg(test)]
pub(crate) mod testing {
    //! An outbox whose queues nobody empties.

    use std::collections::BTreeMap;
    use std::sync::mpsc::Receiver;

    use diagnosis::messages::Speaker;
    use shell::supervision::Supervisor;
    use vocabulary::Component;
    use vocabulary::Condition;

    use super::*;
    use crate::diagnoser::conditions::Conditions;
    use crate::diagnoser::outgoing::audience::Audience;
    use crate::diagnoser::outgoing::{Books, IdentifiedFaults, States};
    use crate::diagnoser::service::Service;

    pub(crate) fn speaker() -> Speaker {
        Speaker::of("tower".parse().unwrap(), "module1".parse().unwrap())
    }

    pub(crate) fn books() -> SharedBooks {
        let components: Vec<Component> = vec!["sensor/g1".parse().unwrap()];
        let service = Service::new(Supervisor::from_environment().pulse(), String::new());
        let conditions = Conditions::new([Condition::NotVerified].iter());
        SharedBooks::new(Books {
            states: States::new(&speaker(), &components, service, conditions),
            faults: IdentifiedFaults::new(&speaker(), &components, BTreeMap::new(), Arc::default()),
            phase: None,
        })
    }

    /// With room for so many events and questions.
    pub(crate) fn outbox(
        journal: Submission,
        room: usize,
    ) -> (Outbox, Receiver<Stored>, Receiver<Asked>) {
        let (events, events_out) = sync_channel(room);
        let (questions, questions_out) = sync_channel(room);
        let (routine, _) = mpsc::channel(1);
        let audiences =
            Audiences { divergences: Audience::default(), progress: Audience::default() };
        let (journal, books, tally) = (Arc::new(journal), books(), Arc::default());
        let outbox = Outbox { journal, books, events, questions, routine, audiences, tally };
        (outbox, events_out, questions_out)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::time::Duration;

    use shell::shutdown;
    use shell::supervision::Supervisor;
    use vocabulary::{FaultTransition, Input, ModulePhase, PhaseChange, RunId, Step, Taken};
    use zenoh::key_expr::KeyExpr;

    use super::super::event_lane::publish;
    use super::testing::{outbox, speaker};
    use super::*;
    use crate::diagnoser::state::{JournalBoard, Keeper, Writer};

    const PATIENCE: Duration = Duration::from_secs(20);

    fn latched(sequence: u64) -> Outgoing {
        let untouched = speaker().untouched(&"sensor/g1".parse().unwrap(), 0);
        let verdict = vocabulary::Verdict::Latched;
        Outgoing::Fault(Box::new(FaultTransition { sequence, verdict, ..untouched }))
    }

    fn identification() -> Outgoing {
        let found = diagnosis::identification::Identification {
            run: RunId(1),
            sequence: 1,
            component: "sensor/g1".parse().unwrap(),
            as_of: Step(5),
            candidates: Vec::new(),
            signature: Vec::new(),
        };
        Outgoing::Identification(Box::new(speaker().identification(found, 0)))
    }

    fn input() -> Outgoing {
        Outgoing::Input(Box::new(Input {
            structure: "tower".parse().unwrap(),
            module: "module1".parse().unwrap(),
            process: 1,
            number: 1,
            samples: 0,
            run: None,
            step: None,
            time_unix_ns: 0,
            taken: Taken::Gap { from: Step(1), missing: 1 },
        }))
    }

    fn phase() -> Outgoing {
        Outgoing::Phase(Box::new(PhaseChange {
            structure: "tower".parse().unwrap(),
            module: "module1".parse().unwrap(),
            phase: ModulePhase::InService,
            before: None,
            run: None,
            step: None,
            reason: String::new(),
            time_unix_ns: 0,
        }))
    }

    /// The thread that writes has started.
    fn journal(directory: &Path) -> (Submission, JournalBoard, std::thread::JoinHandle<()>) {
        let module = "module1".parse().unwrap();
        let (keeper, _) = Keeper::open(Some(directory), 100_000, &module).unwrap();
        let (writer, submission, board) = Writer::new(keeper, None);
        (submission, board, std::thread::spawn(move || writer.run()))
    }

    fn stored(directory: &Path) -> String {
        let records = journal::read(directory).into_iter().flatten();
        records.filter_map(Result::ok).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn a_network_that_takes_nothing_holds_up_no_journal_and_no_order_is_changed() {
        let directory = tempfile::tempdir().unwrap();
        let (submission, board, written) = journal(directory.path());
        let (outbox, events, _) = outbox(submission, 16);
        let (trigger, shutdown) = shutdown::pair();
        let crew = Crew::new(shutdown, Supervisor::from_environment().pulse());
        let (putting, put) = std::sync::mpsc::channel();
        let (open, gate) = std::sync::mpsc::channel::<()>();
        let ended = crew.thread("events", move |lane| {
            publish(&events, &board, lane, |event| {
                let Outgoing::Fault(transition) = event else { return };
                putting.send((transition.sequence, transition.durable)).unwrap();
                gate.recv().unwrap();
            });
        });
        outbox.event(latched(1));
        assert_eq!(put.recv_timeout(PATIENCE).unwrap(), (1, true));
        // From here on the network blocks.
        outbox.event(latched(2));
        outbox.event(latched(3));
        let begun = Instant::now();
        while !stored(directory.path()).contains(r#""sequence":3"#) {
            assert!(begun.elapsed() < PATIENCE, "not stored: {}", stored(directory.path()));
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(put.try_recv().is_err(), "the network is still blocked");
        (0..3).for_each(|_| open.send(()).unwrap());
        let others = [put.recv_timeout(PATIENCE).unwrap(), put.recv_timeout(PATIENCE).unwrap()];
        assert_eq!(others, [(2, true), (3, true)]);
        trigger.pull();
        drop(outbox);
        written.join().unwrap();
        ended.unwrap().blocking_recv().unwrap();
    }

    #[test]
    fn without_a_disk_faults_are_published_and_say_so() {
        let directory = tempfile::tempdir().unwrap();
        let state = directory.path().join("state");
        std::fs::write(&state, "in the way").unwrap();
        let (submission, board, written) = journal(&state);
        let (outbox, events, _) = outbox(submission, 16);
        outbox.event(latched(1));
        let Stored { ticket, .. } = events.recv_timeout(PATIENCE).unwrap();
        assert!(!board.wait_for(ticket));
        drop(outbox);
        written.join().unwrap();
    }

    #[test]
    fn every_event_without_room_is_counted_and_what_it_says_is_stored() {
        let directory = tempfile::tempdir().unwrap();
        let (submission, board, written) = journal(directory.path());
        let (outbox, _events, _) = outbox(submission, 1);
        outbox.event(phase());
        for event in [latched(1), identification(), input(), phase()] {
            outbox.event(event);
        }
        let PublisherCounters { events, events_lost, .. } = outbox.counters();
        assert_eq!((events, events_lost), (5, 4));
        let key = KeyExpr::try_from("trusswatch/**").unwrap();
        let state = outbox.books.lock().states_at(&key).remove(0).1;
        assert_eq!((state.sequence, state.durable), (1, false));
        drop(outbox);
        written.join().unwrap();
        assert!(board.has_all());
        let stored = stored(directory.path());
        for record in ["transition", "identification"] {
            assert!(stored.contains(&format!(r#""record":"{record}""#)), "{stored}");
        }
    }
}
