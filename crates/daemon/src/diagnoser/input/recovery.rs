//! Asks the publisher for samples that were missed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use diagnosis::messages::Speaker;
use parking_lot::Mutex;
use process::{
    PublisherId, ReceivedSample, RecoveryAttempt, RecoveryRetries, SampleRecovery, SampleSource,
};
use tokio::sync::{Notify, mpsc};
use vocabulary::{Encoding, Sample, SampleQuestion, Topic};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, Querier, QueryTarget, Reply};

use super::{SampleReceiver, publisher_id};
use crate::messages::encoding_of;

/// What the publisher still had, sorted by step.
#[derive(Debug)]
pub(crate) struct RecoveredSamples {
    pub(crate) question: SampleQuestion,
    pub(crate) samples: Vec<ReceivedSample>,
}

/// Queries for the module's samples.
#[derive(Debug, Clone)]
pub(crate) struct RecoveryQuerier {
    querier: Arc<Querier<'static>>,
    /// A publisher keeps the samples, and may be out of reach at present.
    is_known: Arc<AtomicBool>,
    receiver: SampleReceiver,
    answers: mpsc::Sender<RecoveredSamples>,
}

impl RecoveryQuerier {
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        receiver: SampleReceiver,
        answers: mpsc::Sender<RecoveredSamples>,
    ) -> zenoh::Result<Self> {
        let querier = session
            .declare_querier(speaker.key(Topic::Sample))
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(RecoveryRetries::TIMEOUT)
            .await?;
        let is_known = Arc::new(AtomicBool::new(querier.matching_status().await?.matching()));
        let known = Arc::clone(&is_known);
        let found = querier.matching_listener().callback(move |status| {
            known.fetch_or(status.matching(), Ordering::Relaxed);
        });
        found.background().await?;
        Ok(Self { querier: Arc::new(querier), is_known, receiver, answers })
    }

    /// Asks in a task of its own; what comes, perhaps nothing, goes into the queue.
    pub(crate) fn ask(&self, question: SampleQuestion) {
        let this = self.clone();
        tokio::spawn(async move {
            let SampleReceiver { module, size, .. } = &this.receiver;
            let recovery = Arc::new(Mutex::new(SampleRecovery::new(module, *size, question)));
            let collected = this.collect_with_retries(&recovery, question);
            // Whatever has come by then is used.
            let _ = tokio::time::timeout(RecoveryRetries::LIMIT, collected).await;
            let samples = recovery.lock().end();
            this.receiver.count(|counters| {
                counters.recoveries_failed += u64::from(samples.is_empty());
                counters.recovered += samples.len() as u64;
            });
            tracing::info!(
                from = %question.from,
                to = %question.to,
                had = samples.len(),
                "requested missed samples from the publisher"
            );
            // Fails only when the diagnoser is ending.
            let _ = this.answers.send(RecoveredSamples { question, samples }).await;
        });
    }

    /// Repeats the query for what has not come yet.
    async fn collect_with_retries(
        &self,
        recovery: &Arc<Mutex<SampleRecovery>>,
        question: SampleQuestion,
    ) {
        let mut retries = RecoveryRetries::starting(Instant::now());
        let mut had = 0;
        let mut rest = Some(question);
        while let Some(missing) = rest {
            let asked = Instant::now();
            let before = self.reaches_a_publisher().await;
            self.collect(missing, recovery).await;
            let reached = (before, self.reaches_a_publisher().await);
            let count = recovery.lock().count();
            let (brought_some, is_known) = (count > had, self.is_known.load(Ordering::Relaxed));
            let attempt = RecoveryAttempt { asked, brought_some, reached, is_known };
            if !retries.again(attempt, Instant::now()) {
                // One that is away for longer than an outage lasts is not waited for again.
                self.is_known.store(reached.1, Ordering::Relaxed);
                return;
            }
            tokio::time::sleep(RecoveryRetries::PAUSE).await;
            had = count;
            rest = recovery.lock().rest();
        }
    }

    /// Does the network know of a publisher that keeps the module's samples?
    async fn reaches_a_publisher(&self) -> bool {
        self.querier.matching_status().await.is_ok_and(|status| status.matching())
    }

    /// Takes the replies to one query, until it ends or nothing is missing any more.
    async fn collect(&self, question: SampleQuestion, recovery: &Arc<Mutex<SampleRecovery>>) {
        let over = Arc::<Notify>::default();
        let reception = Reception {
            receiver: self.receiver.clone(),
            recovery: Arc::clone(recovery),
            over: Arc::clone(&over),
        };
        let query = self.querier.get().parameters(question.to_parameters());
        match query.callback(move |reply| reception.take(reply, question)).await {
            Ok(()) => over.notified().await,
            Err(error) => tracing::debug!("request for missed samples failed: {error}"),
        }
    }
}

/// Takes the replies to one query, on the network's own thread. Dropping it ends the query; so does the last missing
/// sample.
struct Reception {
    receiver: SampleReceiver,
    recovery: Arc<Mutex<SampleRecovery>>,
    over: Arc<Notify>,
}

impl Reception {
    fn take(&self, reply: Reply, question: SampleQuestion) {
        let replier = reply.replier_id().map(publisher_id);
        if let Ok(reply) = reply.into_result() {
            let encoding = encoding_of(reply.encoding());
            self.take_samples(&reply.payload().to_bytes(), encoding, replier, question);
        }
        if self.recovery.lock().rest().is_none() {
            self.over.notify_one();
        }
    }

    /// Takes samples, if they are the publisher's whose samples are used at present. Those of a block may not have been asked
    /// for.
    fn take_samples(
        &self,
        bytes: &[u8],
        encoding: Encoding,
        publisher: Option<PublisherId>,
        question: SampleQuestion,
    ) {
        if !self.receiver.uses(SampleSource { publisher, run: question.run }) {
            self.receiver.refuse_other_source();
            return;
        }
        match Sample::read(bytes, encoding) {
            Ok(samples) => {
                let (mut recovery, now) = (self.recovery.lock(), Instant::now());
                let taken = samples.map(|sample| recovery.take(sample, now));
                if !taken.fold(false, |any, taken| any | taken) {
                    tracing::debug!("ignored unrequested samples");
                }
            }
            Err(error) => tracing::debug!("reply not used: {error}"),
        }
    }
}

impl Drop for Reception {
    fn drop(&mut self) {
        self.over.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    use process::SampleSize;
    use vocabulary::{RunId, Step};

    fn sample(run: u64, step: u64) -> Vec<u8> {
        super::super::tests::sample_of("m1", run, step)
    }

    #[test]
    fn no_reply_is_used_before_a_publisher_is_or_when_that_has_another_run() {
        let module = "m1".parse().unwrap();
        let size = SampleSize { actuators: 0, gages: 0 };
        let question = SampleQuestion { run: RunId(1), from: Step(1), to: Step(3) };
        for (used, taken) in [(None, 0), (Some(2), 0), (Some(1), 1)] {
            let (queue, _out) = mpsc::channel(8);
            let arbitration = (Duration::from_millis(200), 8);
            let receiver = SampleReceiver::new("m1".parse().unwrap(), size, queue, arbitration);
            if let Some(run) = used {
                receiver.take(&sample(run, 9), Encoding::Json, None, Instant::now());
            }
            let recovery = Arc::new(Mutex::new(SampleRecovery::new(&module, size, question)));
            let over = Arc::default();
            let reception = Reception { receiver, recovery, over };
            reception.take_samples(&sample(1, 1), Encoding::Json, None, question);
            reception.take_samples(b"{\"v\":1}", Encoding::Json, None, question);
            let refused = reception.receiver.counters().other_source;
            assert_eq!((reception.recovery.lock().count(), refused), (taken, 2 - 2 * taken as u64));
        }
    }
}
