//! Samples from the network into the diagnoser's queue.
//!
//! The callback runs on the network's own thread, so it never waits: if the queue is full, the sample
//! is dropped and counted.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use diagnosis::Sample;
use tokio::sync::mpsc;
use tokio::sync::mpsc::error::TrySendError;
use truss::ids::ModuleName;
use wire::{DecodeError, IntakeCounters, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use crate::convert::Speaker;
use crate::occurrences::worth_a_line;

/// A sample and when it was published.
#[derive(Debug)]
pub(crate) struct Arrival {
    pub(crate) sample: Sample,
    pub(crate) time_unix_ns: u64,
}

/// What was counted on the way in.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    received: AtomicU64,
    dropped: AtomicU64,
    malformed: AtomicU64,
    unknown_version: AtomicU64,
    wrong_message: AtomicU64,
    other_module: AtomicU64,
}

impl Counters {
    pub(crate) fn read(&self) -> IntakeCounters {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        IntakeCounters {
            received: read(&self.received),
            dropped: read(&self.dropped),
            malformed: read(&self.malformed),
            unknown_version: read(&self.unknown_version),
            wrong_message: read(&self.wrong_message),
            other_module: read(&self.other_module),
        }
    }
}

/// The way in.
#[derive(Debug)]
pub(crate) struct SampleIntake {
    module: ModuleName,
    queue: mpsc::Sender<Arrival>,
    counters: Arc<Counters>,
}

impl SampleIntake {
    pub(crate) fn new(module: ModuleName, queue: mpsc::Sender<Arrival>) -> Self {
        Self { module, queue, counters: Arc::default() }
    }

    pub(crate) fn counters(&self) -> Arc<Counters> {
        Arc::clone(&self.counters)
    }

    pub(crate) async fn subscribe(
        self,
        session: &Session,
        speaker: &Speaker,
    ) -> zenoh::Result<Subscriber<()>> {
        session
            .declare_subscriber(speaker.key(Topic::Sample))
            .callback(move |received| self.take(&received.payload().to_bytes()))
            .await
    }

    fn take(&self, bytes: &[u8]) {
        count(&self.counters.received);
        match wire::decode::<wire::Sample>(bytes) {
            Ok(sample) if sample.module == self.module => self.pass_on(sample),
            Ok(sample) => {
                let problem = format!("a sample of module `{}`", sample.module);
                warn_sometimes(count(&self.counters.other_module), &problem);
            }
            Err(error) => warn_sometimes(count(self.counter_of(&error)), &error.to_string()),
        }
    }

    fn counter_of(&self, error: &DecodeError) -> &AtomicU64 {
        match error {
            DecodeError::TooLong { .. } | DecodeError::NotText | DecodeError::Malformed(_) => {
                &self.counters.malformed
            }
            DecodeError::NoVersion | DecodeError::UnknownVersion(_) => {
                &self.counters.unknown_version
            }
            DecodeError::WrongMessage { .. } => &self.counters.wrong_message,
        }
    }

    fn pass_on(&self, sample: wire::Sample) {
        let wire::Sample {
            module: _,
            run,
            step,
            time_unix_ns,
            demands_n,
            pressures_pa,
            elongations_m,
        } = sample;
        let sample = Sample { run, step, demands_n, pressures_pa, elongations_m };
        match self.queue.try_send(Arrival { sample, time_unix_ns }) {
            // Closed: the diagnoser is ending.
            Ok(()) | Err(TrySendError::Closed(_)) => {}
            Err(TrySendError::Full(_)) => {
                let problem = "the queue is full: samples come faster than they are processed";
                warn_sometimes(count(&self.counters.dropped), problem);
            }
        }
    }
}

fn count(counter: &AtomicU64) -> u64 {
    counter.fetch_add(1, Ordering::Relaxed) + 1
}

fn warn_sometimes(n: u64, problem: &str) {
    if worth_a_line(n) {
        tracing::warn!(times = n, "sample not used: {problem}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use truss::ids::{RunId, Step};

    fn intake(room: usize) -> (SampleIntake, mpsc::Receiver<Arrival>) {
        let (queue, out) = mpsc::channel(room);
        (SampleIntake::new("module1".parse().unwrap(), queue), out)
    }

    fn sample(module: &str, step: u64) -> Vec<u8> {
        wire::encode(&wire::Sample {
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
        let (intake, mut out) = intake(4);
        intake.take(b"{");
        intake.take(&[0xff]);
        intake.take(br#"{"v":1,"step":NaN}"#);
        intake.take(br#"{"v":2}"#);
        intake.take(br#"{"step":1}"#);
        intake.take(br#"{"v":1,"module":"module1","run":1,"step":-1}"#);
        intake.take(&sample("module2", 0));
        intake.take(&sample("module1", 7));
        let expected = IntakeCounters {
            received: 8,
            dropped: 0,
            malformed: 3,
            unknown_version: 2,
            wrong_message: 1,
            other_module: 1,
        };
        assert_eq!(intake.counters.read(), expected);
        assert_eq!(out.try_recv().unwrap().sample.step, Step(7));
        assert!(out.try_recv().is_err());
    }

    #[test]
    fn a_full_queue_drops_the_newest_and_counts_it() {
        let (intake, mut out) = intake(2);
        for step in 0..5 {
            intake.take(&sample("module1", step));
        }
        assert_eq!(intake.counters.read().dropped, 3);
        assert_eq!(out.try_recv().unwrap().sample.step, Step(0));
        assert_eq!(out.try_recv().unwrap().sample.step, Step(1));
    }
}
