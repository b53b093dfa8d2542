//! Asks the publisher for samples that were missed.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::mpsc;
use vocabulary::{SampleQuestion, Topic};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, Querier, QueryTarget};

use super::gathering::{Gathering, Reception};
use super::retry_policy::{OUTAGE, Outcome, RetryPolicy};
use super::tally::{IntakeTally, add, count};
use super::{Arrival, Size};
use diagnosis::messages::Speaker;

/// How long the network waits for the samples. What is lost on the way may take longer, so it is asked again
const TIMEOUT: Duration = Duration::from_millis(500);
/// after this time, if the policy says so (see [`RetryPolicy`]).
const AGAIN_AFTER: Duration = Duration::from_millis(50);
/// The network's own time limit comes first, so that nothing waits for late samples; this one
/// is for a network that fails to keep it.
const GRACE: Duration = Duration::from_millis(700);

/// What the publisher still had, sorted by step.
#[derive(Debug)]
pub(crate) struct Fetched {
    pub(crate) question: SampleQuestion,
    pub(crate) samples: Vec<Arrival>,
}

/// The store of the module's samples.
#[derive(Debug, Clone)]
pub(crate) struct Store {
    querier: Arc<Querier<'static>>,
    /// The samples are kept by somebody, who may be out of reach at present.
    is_known: Arc<AtomicBool>,
    speaker: Speaker,
    size: Size,
    counters: Arc<IntakeTally>,
    answers: mpsc::Sender<Fetched>,
}

impl Store {
    pub(crate) async fn declare(
        session: &Session,
        speaker: &Speaker,
        size: Size,
        counters: Arc<IntakeTally>,
        answers: mpsc::Sender<Fetched>,
    ) -> zenoh::Result<Self> {
        let querier = session
            .declare_querier(speaker.key(Topic::Sample))
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(TIMEOUT)
            .await?;
        let is_known = Arc::new(AtomicBool::new(querier.matching_status().await?.matching()));
        let known = Arc::clone(&is_known);
        let found = querier.matching_listener().callback(move |status| {
            known.fetch_or(status.matching(), Ordering::Relaxed);
        });
        found.background().await?;
        let (querier, speaker) = (Arc::new(querier), speaker.clone());
        Ok(Self { querier, is_known, speaker, size, counters, answers })
    }

    /// Asks in a task of its own; what comes, perhaps nothing, goes into the queue.
    pub(crate) fn ask(&self, question: SampleQuestion) {
        let this = self.clone();
        tokio::spawn(async move {
            let module = &this.speaker.module;
            let gathering = Gathering::new(module, this.size, question, &this.counters);
            let gathering = Arc::new(gathering);
            let collected = this.collect_with_retries(&gathering);
            // Whatever has come by then is used.
            let _ = tokio::time::timeout(OUTAGE + TIMEOUT + GRACE, collected).await;
            let samples = gathering.end();
            if samples.is_empty() {
                count(&this.counters.recoveries_failed);
            }
            add(&this.counters.recovered, samples.len());
            tracing::info!(
                from = %question.from,
                to = %question.to,
                had = samples.len(),
                "asked the publisher for samples missed"
            );
            // Fails only when the diagnoser is ending.
            let _ = this.answers.send(Fetched { question, samples }).await;
        });
    }

    /// Repeats the query for what has not come yet.
    async fn collect_with_retries(&self, gathering: &Arc<Gathering>) {
        let mut retries = RetryPolicy::starting(Instant::now());
        while let Some(rest) = gathering.rest() {
            let (asked, had) = (Instant::now(), gathering.len());
            let before = self.reaches_a_publisher().await;
            self.collect(rest, gathering).await;
            let after = self.reaches_a_publisher().await;
            let outcome = match (before, after) {
                _ if gathering.len() > had => Outcome::CutOff,
                // One that is there all the time and has sent nothing in time has nothing.
                (true, true) if asked.elapsed() < TIMEOUT => Outcome::Nothing,
                (false, false) if !self.is_known.load(Ordering::Relaxed) => Outcome::Nothing,
                _ => Outcome::CutOff,
            };
            if !retries.again(asked, Instant::now(), outcome) {
                // One that is away for longer than an outage lasts is not waited for again.
                self.is_known.store(after, Ordering::Relaxed);
                return;
            }
            tokio::time::sleep(AGAIN_AFTER).await;
        }
    }

    /// Does the network know of a publisher that keeps the module's samples?
    async fn reaches_a_publisher(&self) -> bool {
        self.querier.matching_status().await.is_ok_and(|status| status.matching())
    }

    async fn collect(&self, question: SampleQuestion, gathering: &Arc<Gathering>) {
        let (reception, over) = Reception::into(gathering);
        let query = self.querier.get().parameters(question.to_parameters());
        match query.callback(move |reply| reception.take(reply)).await {
            Ok(()) => over.notified().await,
            Err(error) => tracing::debug!("not asked: {error}"),
        }
    }
}
