//! Polls all states and subscribes to every transition.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use ::observer::News;
use parking_lot::{Mutex, MutexGuard};
use tokio::task::JoinSet;
use vocabulary::{FaultTransition, Key, ModuleName, ModuleStatus, Progress, Step};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

use super::record::Record;
use crate::noted::listen;
use crate::observer::{Hearing, Observer};

/// Polling interval.
const EVERY: Duration = Duration::from_millis(100);

/// The monitoring client of a row.
pub(super) struct Witness {
    session: Session,
    record: Arc<Mutex<Record>>,
    inquiring: JoinSet<()>,
    listening: Option<([Subscriber<()>; 2], Hearing)>,
}

/// A state, and the latest step that its module was known to have processed before it was asked.
pub(super) type State = (FaultTransition, Step);

impl Witness {
    pub(super) async fn of(observer: &Observer, record: Record) -> Self {
        let session = observer.session.clone();
        let record = Arc::new(Mutex::new(record));
        let steady =
            [follow_progress(&session, &record).await, follow_statuses(&session, &record).await];
        let noted = Arc::clone(&record);
        let note = move |news| match news {
            News::Fault(transition) | News::Present(transition) => {
                noted.lock().note_transition(&transition);
            }
            News::Missed { .. } | News::Lost { .. } => noted.lock().note_missed(&news),
            _ => {}
        };
        let listening = Some((steady, observer.hear(note).await));
        let mut inquiring = JoinSet::new();
        inquiring.spawn(ask_again_and_again(session.clone(), Arc::clone(&record)));
        Self { session, record, inquiring, listening }
    }

    pub(super) fn record(&self) -> MutexGuard<'_, Record> {
        self.record.lock()
    }

    /// The present states of every module that replies.
    pub(super) async fn states(&self) -> Vec<State> {
        states(&self.session, &self.record).await
    }

    /// Nothing is noted any more when this returns.
    pub(super) async fn dismiss(&mut self) {
        self.inquiring.shutdown().await;
        drop(self.listening.take());
    }
}

async fn follow_progress(session: &Session, record: &Arc<Mutex<Record>>) -> Subscriber<()> {
    let record = Arc::clone(record);
    let note = move |received: &Sample, progress: Progress| {
        if let Ok(Key::Module { module, .. }) = received.key_expr().as_str().parse::<Key>() {
            record.lock().note_progress(module, progress);
        }
    };
    listen(session, "trusswatch/tower/*/progress", note).await
}

async fn follow_statuses(session: &Session, record: &Arc<Mutex<Record>>) -> Subscriber<()> {
    let record = Arc::clone(record);
    let note = move |_: &Sample, status: ModuleStatus| record.lock().note_status(status);
    listen(session, "trusswatch/tower/*/status", note).await
}

async fn ask_again_and_again(session: Session, record: Arc<Mutex<Record>>) {
    let mut ticks = tokio::time::interval(EVERY);
    ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        for (message, since) in states(&session, &record).await {
            record.lock().note_state(&message, since);
        }
    }
}

async fn states(session: &Session, record: &Mutex<Record>) -> Vec<State> {
    let known: BTreeMap<ModuleName, Step> = {
        let record = record.lock();
        record.standings.iter().map(|(module, at)| (module.clone(), at.step)).collect()
    };
    let states = crate::observer::states(session).await.into_iter();
    let since = |state: &FaultTransition| known.get(&state.module).copied().unwrap_or_default();
    let dated = states.map(|state| {
        let since = since(&state);
        (state, since)
    });
    dated.collect()
}
