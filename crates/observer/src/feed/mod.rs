//! Verdicts, kinds of faults, phases and presence, as they are published.
//!
//! What is published may be missed: a link was cut, a queue was full, the module was not connected yet. So transitions are
//! counted, statuses say how many there were, and what is missing is had from the module's journal; what is known at
//! present is asked for when a module appears.
//!
//! | file | job |
//! |---|---|
//! | `reading` | what a message says |
//! | `continuity` | the transitions of all modules, each once and in order |
//! | `line` | those of one module: what is held back, what is missing, what is asked |
//! | `place` | whether a transition comes after another one |
//! | `retries` | when a question is put again |
//! | `newest` | the newest identification and phase, each once |
//! | `several` | several processes of one module |
//! | `queries` | queries to modules, and what they reply |
//! | `task` | all of it, as long as the feed lives |

mod continuity;
mod line;
mod newest;
mod place;
mod queries;
mod reading;
mod retries;
mod several;
mod task;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::JoinSet;
use vocabulary::{StructureName, keys::Watched};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

use super::presence::AttendanceError;
use super::view::News;
use reading::Arrival;

/// Events that may wait to be taken, and messages that may wait to be looked at.
const QUEUE: usize = 4096;

/// Events of one structure, or of all. It ends when it is dropped, or with its session.
#[derive(Debug)]
pub(crate) struct Feed {
    inbox: Receiver<News>,
    lost: Arc<AtomicU64>,
    _subscribers: Vec<Subscriber<()>>,
    _task: JoinSet<()>,
}

/// Where events are put by who must not wait.
#[derive(Debug, Clone)]
struct Outbox<T> {
    sender: Sender<T>,
    lost: Arc<AtomicU64>,
}

impl<T> Outbox<T> {
    fn put(&self, event: T) {
        if self.sender.try_send(event).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Feed {
    /// Subscribes. The latest of every component and every module comes first.
    ///
    /// # Errors
    /// The network refuses.
    pub(crate) async fn open(
        session: &Session,
        structure: Option<&StructureName>,
    ) -> Result<Self, AttendanceError> {
        let (sender, inbox) = channel(QUEUE);
        let (arrived, arrivals) = channel(QUEUE);
        let lost = Arc::new(AtomicU64::new(0));
        let outbox = Outbox { sender, lost: lost.clone() };
        let arrived = Outbox { sender: arrived, lost: lost.clone() };
        let subscribers = subscribe(session, structure, &arrived)
            .await
            .map_err(|error| AttendanceError::Network(error.to_string()))?;
        // Nothing else may keep the queue open: it is closed with the session.
        drop(arrived);
        let mut task = JoinSet::new();
        task.spawn(task::run(session.clone(), structure.cloned(), arrivals, outbox));
        Ok(Self { inbox, lost, _subscribers: subscribers, _task: task })
    }

    /// The next event; `None` once the session is closed.
    pub(crate) async fn next(&mut self) -> Option<News> {
        match self.lost.swap(0, Ordering::Relaxed) {
            0 => self.inbox.recv().await,
            lost => Some(News::Lost { count: lost }),
        }
    }
}

/// Before anything is asked: what is published after the answer was made is received.
async fn subscribe(
    session: &Session,
    structure: Option<&StructureName>,
    arrived: &Outbox<Arrival>,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let watched = Watched { structure, module: None };
    let mut subscribers = Vec::new();
    let published =
        [watched.faults(), watched.identifications(), watched.phases(), watched.statuses()];
    for expression in published {
        let callback = hand_to(arrived.clone(), reading::message);
        subscribers.push(session.declare_subscriber(expression).callback(callback).await?);
    }
    let tokens = session
        .liveliness()
        .declare_subscriber(watched.tokens())
        .history(true)
        .callback(hand_to(arrived.clone(), reading::token));
    subscribers.push(tokens.await?);
    Ok(subscribers)
}

fn hand_to(
    outbox: Outbox<Arrival>,
    read: impl Fn(&Sample) -> Option<Arrival> + Send + Sync + 'static,
) -> impl Fn(Sample) + Send + Sync + 'static {
    move |sample| {
        if let Some(arrival) = read(&sample) {
            outbox.put(arrival);
        }
    }
}
