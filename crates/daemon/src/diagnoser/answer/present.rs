//! Replies to queries for what is known at present: the states of components, the identifications of their faults, and the
//! phase. A thread of its own replies from the store. No client that reads slowly comes between; the disk does, as before
//! publication, for as long as a fault waits for it.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Instant;

use diagnosis::messages::Speaker;
use shell::clock;
use shell::health::live;
use shell::supervision::{Crew, Ended, Lane, Pulse, Sign};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use vocabulary::keys::Watched;
use vocabulary::{Component, Message, Topic, Unknown};
use zenoh::bytes::Encoding;
use zenoh::key_expr::KeyExpr;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::SharedInquiryCounters;
use crate::diagnoser::publish::{ModuleOutbox, RoutineMessage};
use crate::diagnoser::store::ModuleStore;
use crate::messages::{TOO_MANY_QUESTIONS, put};

/// Questions of each kind that may wait.
const MAX_WAITING: usize = 64;

/// What is asked for.
#[derive(Debug, Clone, Copy)]
enum PresentTopic {
    States,
    Identifications,
    Phase,
}

/// A question.
#[derive(Debug)]
struct PresentQuestion {
    wanted: PresentTopic,
    query: Query,
    /// Its place among those that may wait; free when the question is done with.
    place: OwnedSemaphorePermit,
}

/// What the thread owns.
pub(super) struct PresentReplies {
    speaker: Speaker,
    store: ModuleStore,
    pulse: Arc<Pulse>,
    counters: SharedInquiryCounters,
}

impl PresentReplies {
    /// The store is believed as long as the pulse shows that the diagnosis goes on.
    pub(super) fn new(
        speaker: Speaker,
        store: ModuleStore,
        pulse: Arc<Pulse>,
        counters: SharedInquiryCounters,
    ) -> Self {
        Self { speaker, store, pulse, counters }
    }

    /// Declares the queryables and starts the thread, which ends with them.
    pub(super) async fn declare(
        self,
        session: &Session,
        outbox: &ModuleOutbox,
        crew: &Crew,
    ) -> zenoh::Result<(Vec<Queryable<()>>, Ended)> {
        let (queue, questions) = sync_channel(3 * MAX_WAITING);
        let watched = Watched {
            structure: Some(&self.speaker.structure),
            module: Some(&self.speaker.module),
        };
        let mut queryables = Vec::new();
        for (wanted, key) in [
            (PresentTopic::States, watched.faults()),
            (PresentTopic::Identifications, watched.identifications()),
            (PresentTopic::Phase, watched.phases()),
        ] {
            let refusals = (outbox.clone(), Arc::clone(&self.counters));
            queryables.push(queryable(session, key, wanted, queue.clone(), refusals).await?);
        }
        let ended = crew.thread("replies", move |lane| self.run(&questions, lane))?;
        Ok((queryables, ended))
    }

    /// Replies until nothing can be asked any more.
    fn run(&self, questions: &Receiver<PresentQuestion>, lane: &Lane) {
        while let Ok(PresentQuestion { wanted, query, place }) = questions.recv() {
            lane.begin();
            match wanted {
                PresentTopic::States => self.states(&query),
                PresentTopic::Identifications => self.identifications(&query),
                PresentTopic::Phase => self.phase(&query),
            }
            self.counters.count(|counters| counters.answered += 1);
            drop(place);
            lane.rest();
        }
    }

    /// Like publication, a reply waits for the disk, unless it hangs. What the disk did not have in time when it was
    /// published, it may have by now.
    fn states(&self, query: &Query) {
        let fault = |component: &Component| self.speaker.key(Topic::Fault(component.clone()));
        let wanted = |component: &Component| covers(query.key_expr(), &fault(component));
        let states = loop {
            let state = self.store.lock();
            let stuck = stuck(self.pulse.sign(Instant::now()));
            let mut states =
                state.components.states(&self.speaker, wanted, stuck, clock::unix_ns());
            let ticket = states.iter().map(|published| published.ticket).max().unwrap_or(0);
            if state.writes.answer(ticket, Instant::now()).is_none() {
                drop(state);
                self.store.wait_for(ticket);
                continue;
            }
            for published in &mut states {
                published.state.durable = state.writes.has(published.ticket);
            }
            break states;
        };
        for published in states {
            reply(query, &fault(&published.component), &published.state);
        }
    }

    fn identifications(&self, query: &Query) {
        let key =
            |component: &Component| self.speaker.key(Topic::Identification(component.clone()));
        let wanted = |component: &Component| covers(query.key_expr(), &key(component));
        let found: Vec<_> = {
            let state = self.store.lock();
            state.components.identifications(wanted).cloned().collect()
        };
        for found in found {
            reply(query, &key(&found.component.component), &found);
        }
    }

    /// On the module's own key, for queries to every module at once.
    fn phase(&self, query: &Query) {
        let phase = self.store.lock().components.phase().cloned();
        if let Some(change) = phase {
            reply(query, &self.speaker.key(Topic::Phase), &change);
        }
    }
}

async fn queryable(
    session: &Session,
    key: String,
    wanted: PresentTopic,
    queue: SyncSender<PresentQuestion>,
    (outbox, counters): (ModuleOutbox, SharedInquiryCounters),
) -> zenoh::Result<Queryable<()>> {
    let places = Arc::new(Semaphore::new(MAX_WAITING));
    session
        .declare_queryable(key)
        .callback(move |query: Query| {
            counters.count(|counters| counters.received += 1);
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                counters.count(|counters| counters.turned_away += 1);
                let reason = TOO_MANY_QUESTIONS.to_owned();
                outbox.routine(RoutineMessage::Refusal { query, reason });
                return;
            };
            // There is room for as many as there are places.
            if queue.try_send(PresentQuestion { wanted, query, place }).is_err() {
                counters.count(|counters| counters.turned_away += 1);
            }
        })
        .await
}

fn covers(expression: &KeyExpr<'_>, key: &str) -> bool {
    KeyExpr::try_from(key).is_ok_and(|key| expression.intersects(&key))
}

/// Since when and why nothing is known of the components, if the diagnosis does not go on.
fn stuck(sign: Sign) -> Option<Unknown> {
    let liveness = live(sign);
    if liveness.well {
        return None;
    }
    let age_ns = match sign {
        Sign::Ago(age) | Sign::Stuck(_, age) => u64::try_from(age.as_nanos()).unwrap_or(u64::MAX),
        Sign::NotYet | Sign::Over => 0,
    };
    let since_unix_ns = clock::unix_ns().saturating_sub(age_ns);
    Some(Unknown { since_unix_ns, reason: liveness.words })
}

fn reply<M: Message>(query: &Query, key: &str, message: &M) {
    put(message, |bytes| query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait());
}

#[cfg(test)]
mod tests {
    use shell::shutdown;
    use shell::supervision::Supervisor;

    use super::*;
    use crate::diagnoser::publish::testing::{outbox, speaker};
    use crate::diagnoser::store::JournalWriter;

    #[test]
    fn as_long_as_the_loop_has_not_begun_nothing_is_known() {
        let supervisor = Supervisor::from_environment();
        let sign = || supervisor.pulse().sign(Instant::now());
        assert_eq!(stuck(sign()).unwrap().reason, "opening a session");
        supervisor.progress();
        assert_eq!(stuck(sign()), None);
    }

    /// A session without a network.
    async fn session() -> Session {
        let mut config = zenoh::Config::default();
        config.insert_json5("scouting/multicast/enabled", "false").unwrap();
        config.insert_json5("listen/endpoints", "[]").unwrap();
        zenoh::open(config).await.unwrap()
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_question_is_answered_when_the_reply_is_sent() {
        let module = "module1".parse().unwrap();
        let (_writer, store, _) = JournalWriter::open(None, 0, &module).unwrap();
        let components = ["sensor/g1".parse().unwrap()];
        store.lock().components.configure(&module, &components, String::new(), 0);
        let (outbox, _events) = outbox(store.clone(), 4);
        let (session, counters) = (session().await, SharedInquiryCounters::default());
        let pulse = Supervisor::from_environment().pulse();
        let (trigger, shutdown) = shutdown::pair();
        let crew = Crew::new(shutdown, Arc::clone(&pulse));
        let replies = PresentReplies::new(speaker(), store, pulse, Arc::clone(&counters));
        let (queryables, ended) = replies.declare(&session, &outbox, &crew).await.unwrap();
        let replies = session.get("trusswatch/tower/module1/fault/**").await.unwrap();
        assert!(replies.recv_async().await.unwrap().result().is_ok());
        while replies.recv_async().await.is_ok() {}
        trigger.pull();
        drop(queryables);
        drop(session);
        ended.await.unwrap();
        let read = counters.read();
        assert_eq!((read.received, read.answered), (1, 1));
    }
}
