//! The latest samples of a module, for diagnosers and recorders that missed some.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};
use vocabulary::{Key, ModuleName, RunId, SampleQuestion, Step, StructureName, Topic};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use crate::messages::{TOO_MANY_QUESTIONS, refuse};

/// Samples kept: eight seconds at 1 kHz.
const KEPT: usize = 8192;
/// Questions that may wait.
const MAX_WAITING: usize = 8;

/// The latest samples of a module as they were published, oldest first.
#[derive(Debug, Clone)]
pub(crate) struct RecentSamples {
    run: RunId,
    samples: Arc<Mutex<VecDeque<(Step, ZBytes)>>>,
    /// When a question was last received or answered.
    asked_at: Arc<Mutex<Option<Instant>>>,
}

impl RecentSamples {
    pub(crate) fn new(run: RunId) -> Self {
        let samples = Arc::new(Mutex::new(VecDeque::with_capacity(KEPT)));
        Self { run, samples, asked_at: Arc::default() }
    }

    /// Keeps a sample in place of the oldest.
    pub(crate) fn keep(&self, step: Step, sample: ZBytes) {
        let mut samples = self.samples();
        if samples.len() == KEPT {
            samples.pop_front();
        }
        samples.push_back((step, sample));
    }

    /// Was a question received or answered so recently?
    pub(crate) fn was_asked_within(&self, time: Duration) -> bool {
        let asked_at = *self.asked_at.lock();
        asked_at.is_some_and(|at| at.elapsed() < time)
    }

    fn note_question(&self) {
        *self.asked_at.lock() = Some(Instant::now());
    }

    /// The samples asked for that are still kept, oldest first.
    fn asked(&self, question: SampleQuestion) -> Vec<ZBytes> {
        let samples = self.samples();
        let start = samples.partition_point(|(step, _)| *step < question.from);
        let end = samples.partition_point(|(step, _)| *step <= question.to);
        let range = if question.run == self.run { start..end.max(start) } else { 0..0 };
        samples.range(range).map(|(_, sample)| sample.clone()).collect()
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
                for sample in self.asked(question) {
                    let reply = query
                        .reply(query.key_expr().clone(), sample)
                        .encoding(Encoding::APPLICATION_JSON);
                    if let Err(error) = reply.wait() {
                        tracing::debug!("cannot answer with a past sample: {error}");
                        return;
                    }
                }
            }
            Err(error) => refuse(query, error.to_string()),
        }
    }

    fn samples(&self) -> MutexGuard<'_, VecDeque<(Step, ZBytes)>> {
        self.samples.lock()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_and_still_kept_is_given_again_oldest_first() {
        let recent = RecentSamples::new(RunId(1));
        for step in 0..10_000_u64 {
            recent.keep(Step(step), ZBytes::from(step.to_string()));
        }
        let asked = |run, from, to| {
            let question = SampleQuestion { run: RunId(run), from: Step(from), to: Step(to) };
            let texts = recent.asked(question).into_iter();
            texts.map(|b| b.try_to_string().unwrap().parse().unwrap()).collect::<Vec<u64>>()
        };
        assert_eq!(asked(1, 9990, 20_000), (9990..10_000).collect::<Vec<_>>());
        assert_eq!(asked(1, 0, 1810), (1808..=1810).collect::<Vec<_>>());
        assert_eq!(asked(1, 0, 5), [0; 0]);
        assert_eq!(asked(2, 9990, 20_000), [0; 0]);
    }
}
