//! The latest samples of a module, for diagnosers and recorders that missed some.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};
use vocabulary::{Encoding, Key, ModuleName, RunId, SampleQuestion, Step, StructureName, Topic};
use zenoh::bytes::ZBytes;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::messages::{self, TOO_MANY_QUESTIONS, refuse};

/// Steps kept: eight seconds at 1 kHz.
const KEPT: u64 = 8192;
/// Questions that may wait.
const MAX_WAITING: usize = 8;

/// A message with its first and last step.
type KeptMessage = ((Step, Step), ZBytes);

/// The latest samples of a module as they were published, oldest first.
#[derive(Debug, Clone)]
pub(crate) struct RecentSamples {
    run: RunId,
    encoding: Encoding,
    messages: Arc<Mutex<VecDeque<KeptMessage>>>,
    /// When a question was last received or answered.
    asked_at: Arc<Mutex<Option<Instant>>>,
}

impl RecentSamples {
    pub(crate) fn new(run: RunId, encoding: Encoding) -> Self {
        Self { run, encoding, messages: Arc::default(), asked_at: Arc::default() }
    }

    /// Keeps a message of samples, from a step to a step, in place of those that are too old.
    pub(crate) fn keep(&self, (from, to): (Step, Step), message: ZBytes) {
        let mut messages = self.messages();
        let oldest = to.minus(KEPT - 1);
        while messages.front().is_some_and(|((first, _), _)| *first < oldest) {
            messages.pop_front();
        }
        messages.push_back(((from, to), message));
    }

    /// Was a question received or answered so recently?
    pub(crate) fn was_asked_within(&self, time: Duration) -> bool {
        let asked_at = *self.asked_at.lock();
        asked_at.is_some_and(|at| at.elapsed() < time)
    }

    fn note_question(&self) {
        *self.asked_at.lock() = Some(Instant::now());
    }

    /// The messages with samples asked for that are still kept, oldest first.
    fn asked(&self, question: SampleQuestion) -> Vec<ZBytes> {
        let messages = self.messages();
        let start = messages.partition_point(|((_, last), _)| *last < question.from);
        let end = messages.partition_point(|((first, _), _)| *first <= question.to);
        let range = if question.run == self.run { start..end.max(start) } else { 0..0 };
        messages.range(range).map(|(_, message)| message.clone()).collect()
    }

    /// Answers queries on the module's sample key, on a thread of its own.
    pub(crate) async fn declare(
        &self,
        session: &Session,
        structure: &StructureName,
        module: &ModuleName,
    ) -> zenoh::Result<Queryable<()>> {
        let queue = self.clone().reader()?;
        session
            .declare_queryable(Key::of_module(structure, module, Topic::Sample).to_string())
            .complete(true)
            .callback(move |query| {
                if let Err(error) = queue.try_send(query) {
                    let (std::sync::mpsc::TrySendError::Full(query)
                    | std::sync::mpsc::TrySendError::Disconnected(query)) = error;
                    refuse(&query, TOO_MANY_QUESTIONS.to_owned());
                }
            })
            .await
    }

    fn reader(self) -> std::io::Result<SyncSender<Query>> {
        let (queue, out) = sync_channel::<Query>(MAX_WAITING);
        std::thread::Builder::new().name("recent samples".to_owned()).spawn(move || {
            while let Ok(query) = out.recv() {
                self.note_question();
                self.answer(&query);
                self.note_question();
            }
        })?;
        Ok(queue)
    }

    fn answer(&self, query: &Query) {
        match SampleQuestion::from_parameters(query.parameters().as_str()) {
            Ok(question) => {
                for message in self.asked(question) {
                    let reply = query
                        .reply(query.key_expr().clone(), message)
                        .encoding(messages::encoding(self.encoding));
                    if let Err(error) = reply.wait() {
                        tracing::debug!("cannot answer with a past sample: {error}");
                        return;
                    }
                }
            }
            Err(error) => refuse(query, error.to_string()),
        }
    }

    fn messages(&self) -> MutexGuard<'_, VecDeque<KeptMessage>> {
        self.messages.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_and_still_kept_is_given_again_oldest_first() {
        let recent = RecentSamples::new(RunId(1), Encoding::Json);
        let blocks = RecentSamples::new(RunId(1), Encoding::Cbor);
        for step in 0..10_000_u64 {
            recent.keep((Step(step), Step(step)), ZBytes::from(step.to_string()));
            if step % 10 == 9 {
                blocks.keep((Step(step - 9), Step(step)), ZBytes::from(step.to_string()));
            }
        }
        let asked_of = |recent: &RecentSamples, run, from, to| {
            let question = SampleQuestion { run: RunId(run), from: Step(from), to: Step(to) };
            let texts = recent.asked(question).into_iter();
            texts.map(|b| b.try_to_string().unwrap().parse().unwrap()).collect::<Vec<u64>>()
        };
        let asked = |run, from, to| asked_of(&recent, run, from, to);
        assert_eq!(asked(1, 9990, 20_000), (9990..10_000).collect::<Vec<_>>());
        assert_eq!(asked(1, 0, 1810), (1808..=1810).collect::<Vec<_>>());
        assert_eq!(asked(1, 0, 5), [0; 0]);
        assert_eq!(asked(2, 9990, 20_000), [0; 0]);
        // Whole blocks that overlap with what is asked for; all of their steps are among the latest.
        assert_eq!(asked_of(&blocks, 1, 9985, 9990), [9989, 9999]);
        assert_eq!(asked_of(&blocks, 1, 0, 1815), [1819]);
        assert_eq!(asked_of(&blocks, 1, 0, 1809), [0; 0]);
    }
}
