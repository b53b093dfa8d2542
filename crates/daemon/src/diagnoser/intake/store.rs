//! Asks the publisher for samples that were missed.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use names::Step;
use tokio::sync::mpsc;
use wire::{SampleQuestion, Topic};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget};

use super::tally::{IntakeTally, add, count};
use super::{Arrival, Size};
use crate::convert::Speaker;

/// How long the network waits for the samples. What is lost on the way may take longer, so it is asked again
const TIMEOUT: Duration = Duration::from_millis(500);
/// as long as this is not over: what is missing would blind the channels for longer.
const TOTAL_TIMEOUT: Duration = Duration::from_millis(2500);
/// Where a link is new, samples may come before the network knows who keeps the earlier ones. It is asked
/// again after this time,
const AGAIN_AFTER: Duration = Duration::from_millis(50);
/// as long as this is not over.
const UNANSWERED_FOR: Duration = Duration::from_millis(250);
/// The network's own time limit comes first, so that nothing waits for late samples; this one
/// is for a network that fails to keep it.
const GRACE: Duration = Duration::from_millis(700);

/// How one query ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ending {
    /// All queried publishers have replied.
    Answered,
    /// Time was up.
    TimedOut,
}

/// What the publisher still had, sorted by step.
#[derive(Debug)]
pub(crate) struct Fetched {
    pub(crate) question: SampleQuestion,
    pub(crate) samples: Vec<Arrival>,
}

/// The store of the module's samples.
#[derive(Debug, Clone)]
pub(crate) struct Store {
    session: Session,
    speaker: Speaker,
    size: Size,
    counters: Arc<IntakeTally>,
    answers: mpsc::Sender<Fetched>,
}

impl Store {
    pub(crate) fn new(
        session: &Session,
        speaker: &Speaker,
        size: Size,
        counters: Arc<IntakeTally>,
        answers: mpsc::Sender<Fetched>,
    ) -> Self {
        Self { session: session.clone(), speaker: speaker.clone(), size, counters, answers }
    }

    /// Asks in a task of its own; what comes, perhaps nothing, goes into the queue.
    pub(crate) fn ask(&self, question: SampleQuestion) {
        let this = self.clone();
        tokio::spawn(async move {
            let mut samples = BTreeMap::new();
            let collected = this.collect_with_retries(question, &mut samples);
            // Whatever has come by then is used.
            let _ = tokio::time::timeout(TOTAL_TIMEOUT + GRACE, collected).await;
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
            let samples = samples.into_values().collect();
            // Fails only when the diagnoser is ending.
            let _ = this.answers.send(Fetched { question, samples }).await;
        });
    }

    /// Repeats the query for a while if there is no answer at all, or if the answer gets stuck.
    async fn collect_with_retries(
        &self,
        question: SampleQuestion,
        samples: &mut BTreeMap<Step, Arrival>,
    ) {
        let begin = Instant::now();
        let mut unanswered_since = None;
        while let Some(rest) = rest_of(question, samples) {
            let asked = Instant::now();
            match self.collect(rest, samples).await {
                Ending::Answered if samples.is_empty() => {
                    if unanswered_since.get_or_insert(asked).elapsed() > UNANSWERED_FOR {
                        return;
                    }
                }
                Ending::Answered => return,
                // The network was stuck, so that nobody was heard before.
                Ending::TimedOut => unanswered_since = None,
            }
            if begin.elapsed() > TOTAL_TIMEOUT - TIMEOUT {
                return;
            }
            tokio::time::sleep(AGAIN_AFTER).await;
        }
    }

    async fn collect(
        &self,
        question: SampleQuestion,
        samples: &mut BTreeMap<Step, Arrival>,
    ) -> Ending {
        let selector = format!("{}?{}", self.speaker.key(Topic::Sample), question.to_parameters());
        let begin = Instant::now();
        let replies = self
            .session
            .get(selector)
            .target(QueryTarget::All)
            .consolidation(ConsolidationMode::None)
            .timeout(TIMEOUT)
            .await;
        let Ok(replies) = replies.inspect_err(|error| tracing::debug!("not asked: {error}")) else {
            return Ending::Answered;
        };
        while let Ok(reply) = replies.recv_async().await {
            let Ok(reply) = reply.into_result() else { continue };
            match wire::decode::<wire::Sample>(&reply.payload().to_bytes()) {
                Ok(sample) if self.fits(question, &sample) => {
                    let arrival = Arrival::new(sample, Instant::now(), self.size);
                    samples.entry(arrival.sample.step).or_insert(arrival);
                }
                Ok(_) => tracing::debug!("a sample that was not asked for"),
                Err(error) => tracing::debug!("reply not used: {error}"),
            }
        }
        if begin.elapsed() < TIMEOUT { Ending::Answered } else { Ending::TimedOut }
    }

    fn fits(&self, question: SampleQuestion, sample: &wire::Sample) -> bool {
        sample.module == self.speaker.module
            && sample.run == question.run
            && (question.from..=question.to).contains(&sample.step)
    }
}

/// What has not come yet; samples come oldest first.
fn rest_of(question: SampleQuestion, samples: &BTreeMap<Step, Arrival>) -> Option<SampleQuestion> {
    let from = samples.keys().next_back().map_or(question.from, |latest| latest.plus(1));
    (from <= question.to).then_some(SampleQuestion { from, ..question })
}
