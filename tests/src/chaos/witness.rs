//! Asks for all states again and again and listens to every transition.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::task::JoinHandle;
use truss::ids::{ModuleName, Step};
use wire::{FaultTransition, Key, ModuleStatus, Progress};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use super::record::Record;
use crate::observer::{Faults, Observer};

/// From one question to the next.
const EVERY: Duration = Duration::from_millis(100);

/// Who looks on during a row.
pub(super) struct Witness {
    session: Session,
    record: Arc<Mutex<Record>>,
    tasks: Vec<JoinHandle<()>>,
    _subscribers: [Subscriber<()>; 2],
}

/// A state, and the latest step that its module was known to have processed before it was asked.
pub(super) type State = (FaultTransition, Step);

impl Witness {
    pub(super) async fn of(observer: &Observer, record: Record) -> Self {
        let session = observer.session.clone();
        let record = Arc::new(Mutex::new(record));
        let subscribers =
            [follow_progress(&session, &record).await, follow_statuses(&session, &record).await];
        let faults = observer.faults().await;
        let tasks = vec![
            tokio::spawn(listen(faults, Arc::clone(&record))),
            tokio::spawn(ask_again_and_again(session.clone(), Arc::clone(&record))),
        ];
        Self { session, record, tasks, _subscribers: subscribers }
    }

    pub(super) fn record(&self) -> MutexGuard<'_, Record> {
        lock(&self.record)
    }

    /// What every module that answers says now.
    pub(super) async fn states(&self) -> Vec<State> {
        states(&self.session, &self.record).await
    }

    /// Nothing is noted any more when this returns.
    pub(super) async fn dismiss(&mut self) {
        for task in self.tasks.drain(..) {
            task.abort();
            // Its end is that it was aborted.
            let _ = task.await;
        }
    }
}

impl Drop for Witness {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}

fn lock(record: &Mutex<Record>) -> MutexGuard<'_, Record> {
    record.lock().unwrap_or_else(PoisonError::into_inner)
}

async fn follow_progress(session: &Session, record: &Arc<Mutex<Record>>) -> Subscriber<()> {
    let record = Arc::clone(record);
    let callback = move |received: zenoh::sample::Sample| {
        let key = received.key_expr().as_str().parse();
        let progress = wire::decode::<Progress>(&received.payload().to_bytes());
        if let (Ok(Key::Module { module, .. }), Ok(progress)) = (key, progress) {
            lock(&record).note_progress(module, progress);
        }
    };
    let subscriber = session.declare_subscriber("trusswatch/tower/*/progress");
    subscriber.callback(callback).await.unwrap()
}

async fn follow_statuses(session: &Session, record: &Arc<Mutex<Record>>) -> Subscriber<()> {
    let record = Arc::clone(record);
    let callback = move |received: zenoh::sample::Sample| {
        if let Ok(status) = wire::decode::<ModuleStatus>(&received.payload().to_bytes()) {
            lock(&record).note_status(status);
        }
    };
    let subscriber = session.declare_subscriber("trusswatch/tower/*/status");
    subscriber.callback(callback).await.unwrap()
}

async fn listen(mut faults: Faults, record: Arc<Mutex<Record>>) {
    while let Some((_, message)) = faults.recv().await {
        lock(&record).note_transition(&message);
    }
}

async fn ask_again_and_again(session: Session, record: Arc<Mutex<Record>>) {
    let mut ticks = tokio::time::interval(EVERY);
    ticks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        for (message, since) in states(&session, &record).await {
            lock(&record).note_state(&message, since);
        }
    }
}

async fn states(session: &Session, record: &Mutex<Record>) -> Vec<State> {
    let known: BTreeMap<ModuleName, Step> = {
        let record = lock(record);
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
