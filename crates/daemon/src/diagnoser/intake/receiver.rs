//! The network's callback.
//!
//! It runs on the network's own thread, so it never waits: if the queue is full, the sample is dropped
//! and counted, and the diagnosis is informed, so that it drops its backlog.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};
use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TrySendError;
use vocabulary::{ModuleName, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::session::EntityGlobalId;

use super::incumbent::{Admission, Incumbent, Source};
use super::refusals::Refusals;
use super::tally::{IntakeTally, Refused, add, count};
use super::{Arrival, Size};
use diagnosis::messages::Speaker;

/// The way in.
#[derive(Debug, Clone)]
pub(crate) struct Receiver {
    module: ModuleName,
    size: Size,
    queue: mpsc::Sender<Arrival>,
    counters: Arc<IntakeTally>,
    refusals: Arc<Refusals>,
    incumbent: Arc<Mutex<Incumbent>>,
    overflown: Arc<AtomicBool>,
}

impl Receiver {
    /// `hold` and `room` are those of the incumbent.
    pub(crate) fn new(
        module: ModuleName,
        size: Size,
        queue: mpsc::Sender<Arrival>,
        hold: Duration,
        room: usize,
    ) -> Self {
        Self {
            module,
            size,
            queue,
            counters: Arc::default(),
            refusals: Arc::default(),
            incumbent: Arc::new(Mutex::new(Incumbent::new(hold, room))),
            overflown: Arc::default(),
        }
    }

    pub(crate) fn counters(&self) -> Arc<IntakeTally> {
        Arc::clone(&self.counters)
    }

    pub(crate) fn refusals(&self) -> Arc<Refusals> {
        Arc::clone(&self.refusals)
    }

    pub(crate) async fn subscribe(
        &self,
        session: &Session,
        speaker: &Speaker,
    ) -> zenoh::Result<Subscriber<()>> {
        let this = self.clone();
        session
            .declare_subscriber(speaker.key(Topic::Sample))
            .callback(move |received| {
                let publisher = received.source_info().map(|info| *info.source_id());
                this.take(&received.payload().to_bytes(), publisher, Instant::now());
            })
            .await
    }

    /// Was a sample dropped since this was last asked?
    pub(crate) fn take_overflow(&self) -> bool {
        self.overflown.swap(false, Ordering::Relaxed)
    }

    /// Checks whether another publisher may take the place of one that is silent.
    pub(crate) fn tick(&self, now: Instant) {
        self.pass_all_on(self.arbitrate(|incumbent| incumbent.promote(now)));
    }

    fn take(&self, bytes: &[u8], publisher: Option<EntityGlobalId>, now: Instant) {
        count(&self.counters.received);
        match vocabulary::decode::<vocabulary::Sample>(bytes) {
            Ok(sample) if sample.module == self.module => {
                self.admit(
                    Source { publisher, run: sample.run },
                    Arrival::new(sample, now, self.size),
                );
            }
            Ok(sample) => {
                let problem = format!("a sample of module `{}`", sample.module);
                self.refuse(&self.counters.other_module, problem, now);
            }
            Err(error) => {
                self.refuse(self.counters.of_error(&error), error.to_string(), now);
            }
        }
    }

    fn refuse(&self, kind: &Refused, problem: String, now: Instant) {
        kind.note(&problem, now);
        self.refusals.note(problem, now);
    }

    fn admit(&self, source: Source, arrival: Arrival) {
        match self.arbitrate(|incumbent| incumbent.admit(source, arrival)) {
            Admission::Use(arrival) => self.pass_on(arrival),
            Admission::UseAll(arrivals) => self.pass_all_on(arrivals),
            Admission::PutAside => refuse_other_source(&self.counters),
        }
    }

    fn pass_all_on(&self, arrivals: VecDeque<Arrival>) {
        for arrival in arrivals {
            self.pass_on(arrival);
        }
    }

    fn pass_on(&self, arrival: Arrival) {
        match self.queue.try_send(arrival) {
            // Closed: the diagnoser is ending.
            Ok(()) | Err(TrySendError::Closed(_)) => {}
            Err(TrySendError::Full(_)) => {
                self.overflown.store(true, Ordering::Relaxed);
                add(&self.counters.dropped, 1);
            }
        }
    }

    /// Has it decided whose samples are used, and notes whose they are, before any of them is.
    fn arbitrate<T>(&self, decide: impl FnOnce(&mut Incumbent) -> T) -> T {
        let mut incumbent = self.incumbent();
        let decision = decide(&mut incumbent);
        self.counters.note_source(incumbent.present());
        decision
    }

    /// Every change is made whole or not at all, so a thread that failed has left it in order.
    fn incumbent(&self) -> MutexGuard<'_, Incumbent> {
        self.incumbent.lock()
    }
}

/// Counts a sample of somebody else than the publisher whose samples are used.
pub(super) fn refuse_other_source(counters: &IntakeTally) {
    let problem = "it is another publisher's or another run's, and the present one goes on";
    counters.other_source.note(problem, Instant::now());
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{IntakeCounters, RunId, Step};

    fn receiver(room: usize) -> (Receiver, mpsc::Receiver<Arrival>) {
        let (queue, out) = mpsc::channel(room);
        let module = "module1".parse().unwrap();
        (
            Receiver::new(
                module,
                Size { actuators: 2, gages: 3 },
                queue,
                Duration::from_millis(200),
                8,
            ),
            out,
        )
    }

    fn sample(module: &str, step: u64) -> Vec<u8> {
        vocabulary::encode(&vocabulary::Sample {
            module: module.parse().unwrap(),
            run: RunId(1),
            step: Step(step),
            time_unix_ns: 5,
            demands_n: vec![],
            pressures_pa: vec![],
            elongations_m: vec![],
        })
        .unwrap()
    }

    #[test]
    fn each_kind_of_bad_sample_has_its_own_counter_and_good_ones_still_pass() {
        let (receiver, mut out) = receiver(4);
        let now = Instant::now();
        let take = |bytes: &[u8]| receiver.take(bytes, None, now);
        take(b"{");
        take(&[0xff]);
        take(br#"{"v":1,"step":NaN}"#);
        take(br#"{"v":2}"#);
        take(br#"{"step":1}"#);
        take(br#"{"v":1,"module":"module1","run":1,"step":-1}"#);
        take(&sample("module2", 0));
        take(&sample("module1", 7));
        let other = String::from_utf8(sample("module1", 8)).unwrap();
        take(other.replace("\"run\":1", "\"run\":2").as_bytes());
        let expected = IntakeCounters {
            received: 9,
            malformed: 3,
            unknown_version: 2,
            wrong_message: 1,
            other_module: 1,
            other_source: 1,
            ..IntakeCounters::default()
        };
        assert_eq!(receiver.counters.read(), expected);
        assert_eq!(out.try_recv().unwrap().sample.step, Step(7));
        assert!(out.try_recv().is_err());
    }

    #[test]
    fn a_full_queue_drops_the_newest_counts_it_and_says_so() {
        let (receiver, mut out) = receiver(2);
        for step in 0..5 {
            receiver.take(&sample("module1", step), None, Instant::now());
        }
        assert_eq!(receiver.counters.read().dropped, 3);
        assert!(receiver.take_overflow() && !receiver.take_overflow());
        assert_eq!(out.try_recv().unwrap().sample.step, Step(0));
        assert_eq!(out.try_recv().unwrap().sample.step, Step(1));
    }
}
