//! Samples from the network: decoded, arbitrated between publishers, and queued for the diagnosis.
//!
//! The subscriber's callback runs on the network's own thread, so it never waits: if the queue is full, the sample is
//! dropped and counted, and the diagnosis is informed, so that it drops its backlog. Samples that were missed come by
//! `recovery`.

mod recovery;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use diagnosis::messages::Speaker;
use parking_lot::Mutex;
use process::{
    Arbitration, PublisherArbiter, PublisherId, ReceivedSample, RecentRefusals, SampleSize,
    SampleSource,
};
use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TrySendError;
use vocabulary::Occurrences;
use vocabulary::{DecodeError, Encoding, IntakeCounters, ModuleName, Sample, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::session::EntityGlobalId;

pub(crate) use recovery::{RecoveredSamples, RecoveryQuerier};

use crate::counters::SharedCounters;
use crate::messages::encoding_of;

/// Takes samples; every clone takes into the same queue.
#[derive(Debug, Clone)]
pub(crate) struct SampleReceiver {
    module: ModuleName,
    size: SampleSize,
    queue: mpsc::Sender<ReceivedSample>,
    shared: Arc<SharedInput>,
}

#[derive(Debug)]
struct SharedInput {
    counters: SharedCounters<IntakeCounters>,
    arbiter: Mutex<PublisherArbiter>,
    refusals: Mutex<RecentRefusals>,
    /// Log lines on refused samples, by kind.
    lines: Mutex<BTreeMap<&'static str, Occurrences>>,
    overflown: AtomicBool,
}

impl SampleReceiver {
    /// A publisher silent for `hold` may be replaced; `room` samples of another one are kept.
    pub(crate) fn new(
        module: ModuleName,
        size: SampleSize,
        queue: mpsc::Sender<ReceivedSample>,
        (hold, room): (Duration, usize),
    ) -> Self {
        let shared = SharedInput {
            counters: SharedCounters::default(),
            arbiter: Mutex::new(PublisherArbiter::new(hold, room)),
            refusals: Mutex::default(),
            lines: Mutex::default(),
            overflown: AtomicBool::new(false),
        };
        Self { module, size, queue, shared: Arc::new(shared) }
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
                let publisher = received.source_info().map(|info| publisher_id(*info.source_id()));
                let bytes = received.payload().to_bytes();
                this.take(&bytes, encoding_of(received.encoding()), publisher, Instant::now());
            })
            .await
    }

    /// Counts something that happened to samples.
    pub(crate) fn count(&self, count: impl FnOnce(&mut IntakeCounters)) {
        self.shared.counters.count(count);
    }

    pub(crate) fn counters(&self) -> IntakeCounters {
        self.shared.counters.read()
    }

    /// A sample was refused, here or by the diagnosis.
    pub(crate) fn note_refusal(&self, reason: String, now: Instant) {
        self.shared.refusals.lock().note(reason, now);
    }

    /// The latest refusals.
    pub(crate) fn refusals(&self) -> parking_lot::MutexGuard<'_, RecentRefusals> {
        self.shared.refusals.lock()
    }

    /// Was a sample dropped since this was last asked?
    pub(crate) fn take_overflow(&self) -> bool {
        self.shared.overflown.swap(false, Ordering::Relaxed)
    }

    /// Checks whether another publisher may take the place of one that is silent.
    pub(crate) fn tick(&self, now: Instant) {
        let promoted = self.shared.arbiter.lock().promote(now);
        promoted.into_iter().for_each(|arrival| self.pass_on(arrival));
    }

    /// Are samples used that this one gives in reply to a query?
    fn uses(&self, replier: SampleSource) -> bool {
        let present = self.shared.arbiter.lock().present();
        present.is_some_and(|source| source.replies_as(replier))
    }

    fn take(&self, bytes: &[u8], encoding: Encoding, publisher: Option<PublisherId>, now: Instant) {
        match Sample::read(bytes, encoding) {
            Ok(samples) => samples.for_each(|sample| self.take_step(sample, publisher, now)),
            Err(error) => {
                self.count(|counters| counters.received += 1);
                let kind = self.count_error(&error);
                self.refuse(kind, error.to_string(), now);
            }
        }
    }

    fn take_step(&self, sample: Sample, publisher: Option<PublisherId>, now: Instant) {
        self.count(|counters| counters.received += 1);
        if sample.module == self.module {
            let source = SampleSource { publisher, run: sample.run };
            self.admit(source, ReceivedSample::new(sample, now, self.size));
        } else {
            self.count(|counters| counters.other_module += 1);
            self.refuse("module", format!("a sample of module `{}`", sample.module), now);
        }
    }

    /// Counts a message that is not a sample. Returns its kind.
    fn count_error(&self, error: &DecodeError) -> &'static str {
        let (kind, count): (_, fn(&mut IntakeCounters) -> &mut u64) = match error {
            DecodeError::TooLong { .. } | DecodeError::NotText | DecodeError::Malformed(_) => {
                ("malformed", |counters| &mut counters.malformed)
            }
            DecodeError::NoVersion | DecodeError::UnknownVersion(_) => {
                ("version", |counters| &mut counters.unknown_version)
            }
            DecodeError::WrongMessage { .. } => ("message", |counters| &mut counters.wrong_message),
        };
        self.count(|counters| *count(counters) += 1);
        kind
    }

    fn refuse(&self, kind: &'static str, problem: String, now: Instant) {
        self.log_refusal(kind, &problem, now);
        self.note_refusal(problem, now);
    }

    fn log_refusal(&self, kind: &'static str, problem: &str, now: Instant) {
        let times = self.shared.lines.lock().entry(kind).or_default().note(now);
        if let Some(times) = times {
            tracing::warn!(times, "sample not used: {problem}");
        }
    }

    fn admit(&self, source: SampleSource, arrival: ReceivedSample) {
        let admission = self.shared.arbiter.lock().admit(source, arrival);
        match admission {
            Arbitration::Use(arrival) => self.pass_on(arrival),
            Arbitration::UseAll(arrivals) => {
                arrivals.into_iter().for_each(|arrival| self.pass_on(arrival));
            }
            Arbitration::PutAside => self.refuse_other_source(),
        }
    }

    /// Counts a sample of another publisher than the one whose samples are used.
    fn refuse_other_source(&self) {
        self.count(|counters| counters.other_source += 1);
        let problem = "it comes from another publisher or run while the present one is active";
        self.log_refusal("source", problem, Instant::now());
    }

    fn pass_on(&self, arrival: ReceivedSample) {
        match self.queue.try_send(arrival) {
            // Closed: the diagnoser is ending.
            Ok(()) | Err(TrySendError::Closed(_)) => {}
            Err(TrySendError::Full(_)) => {
                self.shared.overflown.store(true, Ordering::Relaxed);
                self.count(|counters| counters.dropped += 1);
            }
        }
    }
}

fn publisher_id(id: EntityGlobalId) -> PublisherId {
    PublisherId { session: id.zid().to_le_bytes(), entity: id.eid() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    fn receiver(room: usize) -> (SampleReceiver, mpsc::Receiver<ReceivedSample>) {
        let (queue, out) = mpsc::channel(room);
        let size = SampleSize { actuators: 2, gages: 3 };
        let arbitration = (Duration::from_millis(200), 8);
        (SampleReceiver::new("module1".parse().unwrap(), size, queue, arbitration), out)
    }

    /// A sample without signals, as it comes over the network.
    pub(super) fn sample_of(module: &str, run: u64, step: u64) -> Vec<u8> {
        vocabulary::encode(&vocabulary::Sample {
            module: module.parse().unwrap(),
            run: RunId(run),
            step: Step(step),
            time_unix_ns: 5,
            demands_n: vec![],
            pressures_pa: vec![],
            elongations_m: vec![],
            readings: vec![],
            block: Vec::new(),
        })
        .unwrap()
    }

    fn sample(module: &str, step: u64) -> Vec<u8> {
        sample_of(module, 1, step)
    }

    #[test]
    fn each_kind_of_bad_sample_has_its_own_counter_and_good_ones_still_pass() {
        let (receiver, mut out) = receiver(4);
        let now = Instant::now();
        let take = |bytes: &[u8]| receiver.take(bytes, Encoding::Json, None, now);
        take(b"{");
        take(&[0xff]);
        take(br#"{"v":1,"step":nope}"#);
        take(br#"{"v":2}"#);
        take(br#"{"step":1}"#);
        take(br#"{"v":1,"module":"module1","run":1,"step":-1}"#);
        take(&sample("module2", 0));
        take(&sample("module1", 7));
        let other = String::from_utf8(sample("module1", 8)).unwrap();
        take(other.replace("\"run\":1", "\"run\":2").as_bytes());
        receiver.take(&sample("module1", 8), Encoding::Cbor, None, now);
        let expected = IntakeCounters {
            received: 10,
            malformed: 3,
            unknown_version: 2,
            // JSON called CBOR is a text there.
            wrong_message: 2,
            other_module: 1,
            other_source: 1,
            ..IntakeCounters::default()
        };
        assert_eq!(receiver.counters(), expected);
        assert_eq!(out.try_recv().unwrap().sample.step, Step(7));
        assert!(out.try_recv().is_err());
    }

    #[test]
    fn a_full_queue_drops_the_newest_counts_it_and_says_so() {
        let (receiver, mut out) = receiver(2);
        for step in 0..5 {
            receiver.take(&sample("module1", step), Encoding::Json, None, Instant::now());
        }
        assert_eq!(receiver.counters().dropped, 3);
        assert!(receiver.take_overflow() && !receiver.take_overflow());
        assert_eq!(out.try_recv().unwrap().sample.step, Step(0));
        assert_eq!(out.try_recv().unwrap().sample.step, Step(1));
    }
}
