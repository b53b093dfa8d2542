//! The samples that were asked for, as far as they have come.
//!
//! It is filled on the network's own thread, which never waits for it: there is room for one sample of each step.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use parking_lot::{Mutex, MutexGuard};
use tokio::sync::Notify;
use vocabulary::{ModuleName, SampleQuestion, Step};
use zenoh::query::Reply;
use zenoh::session::EntityGlobalId;

use super::incumbent::Source;
use super::receiver::refuse_other_source;
use super::tally::IntakeTally;
use super::{Arrival, Size};

/// The samples of one question, which several queries may bring.
#[derive(Debug)]
pub(super) struct Gathering {
    module: ModuleName,
    size: Size,
    question: SampleQuestion,
    counters: Arc<IntakeTally>,
    samples: Mutex<BTreeMap<Step, Arrival>>,
}

impl Gathering {
    pub(super) fn new(
        module: &ModuleName,
        size: Size,
        question: SampleQuestion,
        counters: &Arc<IntakeTally>,
    ) -> Self {
        let (module, counters) = (module.clone(), Arc::clone(counters));
        Self { module, size, question, counters, samples: Mutex::default() }
    }

    /// Takes a reply, if it is the publisher's whose samples are used at present.
    fn take(&self, reply: Reply) {
        let replier = reply.replier_id();
        let Ok(reply) = reply.into_result() else { return };
        self.take_sample(&reply.payload().to_bytes(), replier);
    }

    fn take_sample(&self, bytes: &[u8], replier: Option<EntityGlobalId>) {
        let source = Source { publisher: replier, run: self.question.run };
        if !self.counters.uses(source) {
            refuse_other_source(&self.counters);
            return;
        }
        match vocabulary::decode::<vocabulary::Sample>(bytes) {
            Ok(sample) if self.fits(&sample) => {
                let arrival = Arrival::new(sample, Instant::now(), self.size);
                self.samples().entry(arrival.sample.step).or_insert(arrival);
            }
            Ok(_) => tracing::debug!("a sample that was not asked for"),
            Err(error) => tracing::debug!("reply not used: {error}"),
        }
    }

    fn fits(&self, sample: &vocabulary::Sample) -> bool {
        sample.module == self.module
            && sample.run == self.question.run
            && (self.question.from..=self.question.to).contains(&sample.step)
    }

    /// What has not come yet; samples come oldest first.
    pub(super) fn rest(&self) -> Option<SampleQuestion> {
        let SampleQuestion { from, to, .. } = self.question;
        let from = self.samples().keys().next_back().map_or(from, |latest| latest.plus(1));
        (from <= to).then_some(SampleQuestion { from, ..self.question })
    }

    /// How many have come.
    pub(super) fn len(&self) -> usize {
        self.samples().len()
    }

    /// What has come, sorted by step.
    pub(super) fn end(&self) -> Vec<Arrival> {
        std::mem::take(&mut *self.samples()).into_values().collect()
    }

    /// Every change is made whole or not at all, so a thread that failed has left it in order.
    fn samples(&self) -> MutexGuard<'_, BTreeMap<Step, Arrival>> {
        self.samples.lock()
    }
}

/// Takes the replies to one query. It is over when this is dropped, or when nothing is missing any more.
#[derive(Debug)]
pub(super) struct Reception {
    gathering: Arc<Gathering>,
    over: Arc<Notify>,
}

impl Reception {
    /// One, and what is notified when it is over.
    pub(super) fn into(gathering: &Arc<Gathering>) -> (Self, Arc<Notify>) {
        let over = Arc::<Notify>::default();
        (Self { gathering: Arc::clone(gathering), over: Arc::clone(&over) }, over)
    }

    pub(super) fn take(&self, reply: Reply) {
        self.gathering.take(reply);
        if self.gathering.rest().is_none() {
            self.over.notify_one();
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
    use vocabulary::RunId;

    const SIZE: Size = Size { actuators: 0, gages: 0 };

    fn gathering(from: u64, to: u64) -> (Gathering, Arc<IntakeTally>) {
        let question = SampleQuestion { run: RunId(1), from: Step(from), to: Step(to) };
        let counters = Arc::<IntakeTally>::default();
        (Gathering::new(&"m1".parse().unwrap(), SIZE, question, &counters), counters)
    }

    fn sample(module: &str, run: u64, step: u64) -> Vec<u8> {
        vocabulary::encode(&vocabulary::Sample {
            module: module.parse().unwrap(),
            run: RunId(run),
            step: Step(step),
            time_unix_ns: 5,
            demands_n: vec![],
            pressures_pa: vec![],
            elongations_m: vec![],
        })
        .unwrap()
    }

    fn of_run(run: u64) -> Option<Source> {
        Some(Source { publisher: None, run: RunId(run) })
    }

    #[test]
    fn nobody_is_believed_before_a_publisher_is_or_when_that_has_another_run() {
        let (gathering, counters) = gathering(1, 3);
        for source in [None, of_run(2)] {
            counters.note_source(source);
            gathering.take_sample(&sample("m1", 1, 1), None);
        }
        assert_eq!((gathering.len(), counters.read().other_source), (0, 2));
        counters.note_source(of_run(1));
        gathering.take_sample(&sample("m1", 1, 1), None);
        assert_eq!((gathering.len(), counters.read().other_source), (1, 2));
    }

    #[test]
    fn there_is_room_for_what_was_asked_for_once_and_for_nothing_else() {
        let (gathering, counters) = gathering(1, 3);
        counters.note_source(of_run(1));
        for bytes in [sample("m2", 1, 1), sample("m1", 2, 1), b"{\"v\":1}".to_vec()] {
            gathering.take_sample(&bytes, None);
        }
        assert_eq!(gathering.rest().map(|rest| rest.from), Some(Step(1)));
        for step in [0, 1, 1, 2, 4, 2] {
            gathering.take_sample(&sample("m1", 1, step), None);
        }
        assert_eq!(gathering.rest().map(|rest| (rest.from, rest.to)), Some((Step(3), Step(3))));
        gathering.take_sample(&sample("m1", 1, 3), None);
        assert_eq!(gathering.rest(), None);
        let steps: Vec<u64> = gathering.end().iter().map(|arrival| arrival.sample.step.0).collect();
        assert_eq!(steps, [1, 2, 3]);
    }
}
