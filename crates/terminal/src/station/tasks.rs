//! Orders and queries to modules, each a task whose result is queued here.

use std::future::Future;
use std::time::Duration;

use observer::{ComponentId, ModuleHistory, ModuleId, OrderOutcome, QueryError};
use session::client::DivergenceFeed;
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::{AbortHandle, JoinSet};
use zenoh::Session;

use crate::model::{ModelEffect, TaskResult};

/// Capacity of the result queue.
const QUEUE: usize = 256;
/// The outcome of every task before a session is open.
const NO_NETWORK: &str = "the network is not connected";

/// All tasks in progress; dropping this aborts them.
pub(super) struct Tasks {
    timeout: Duration,
    tasks: JoinSet<()>,
    listening: Option<AbortHandle>,
    outlet: Sender<TaskResult>,
    inbox: Receiver<TaskResult>,
}

impl Tasks {
    pub(super) fn new(timeout: Duration) -> Self {
        let (outlet, inbox) = channel(QUEUE);
        Self { timeout, tasks: JoinSet::new(), listening: None, outlet, inbox }
    }

    /// The next result; cancel-safe.
    pub(super) async fn next(&mut self) -> Option<TaskResult> {
        self.inbox.recv().await
    }

    /// Starts an effect without blocking.
    pub(super) fn send(&mut self, effect: ModelEffect, session: Option<Session>) {
        while self.tasks.try_join_next().is_some() {}
        let timeout = self.timeout;
        match effect {
            ModelEffect::Listen(whom) => self.listen(whom, session),
            ModelEffect::Order(request) => self.start(async move {
                let outcome = match session {
                    Some(session) => {
                        session::client::order(&session, &request, timeout).await.into()
                    }
                    None => OrderOutcome::not_sent(NO_NETWORK),
                };
                TaskResult::Order(request, outcome)
            }),
            ModelEffect::Frame(fault) => self.start(async move {
                let frame = match session {
                    Some(session) => {
                        session::client::freeze_frame_of(&session, &fault, timeout).await
                    }
                    None => Err(NO_NETWORK.to_owned()),
                };
                TaskResult::Frame(ComponentId::of(&fault), frame.map(Box::new))
            }),
            ModelEffect::Identification(subject) => {
                self.start(identification(session, subject, timeout));
            }
            ModelEffect::History(subject) => self.start(history(session, subject, timeout)),
            ModelEffect::Suspend | ModelEffect::Quit => {}
        }
    }

    fn start(&mut self, task: impl Future<Output = TaskResult> + Send + 'static) {
        let outlet = self.outlet.clone();
        self.tasks.spawn(async move {
            // The receiver is gone when the view ends.
            let _ = outlet.send(task.await).await;
        });
    }

    /// Subscribes to divergences, which a diagnoser publishes only while there is a subscriber.
    fn listen(&mut self, whom: Option<ModuleId>, session: Option<Session>) {
        if let Some(former) = self.listening.take() {
            former.abort();
        }
        let (Some(ModuleId { structure: Some(structure), module }), Some(session)) =
            (whom, session)
        else {
            return;
        };
        let outlet = self.outlet.clone();
        let task = self.tasks.spawn(async move {
            let Ok(mut feed) = DivergenceFeed::open(&session, &structure, &module).await else {
                return;
            };
            while let Some(message) = feed.next().await {
                if outlet.send(TaskResult::Divergences(Box::new(message))).await.is_err() {
                    return;
                }
            }
        });
        self.listening = Some(task);
    }
}

async fn identification(
    session: Option<Session>,
    subject: ComponentId,
    timeout: Duration,
) -> TaskResult {
    let found = match session {
        Some(session) => {
            let ComponentId { structure, component } = &subject;
            let found =
                session::client::identification(&session, structure, component, timeout).await;
            found.map(|found| found.map(Box::new)).map_err(|error| error.to_string())
        }
        None => Err(NO_NETWORK.to_owned()),
    };
    TaskResult::Identification(subject, found)
}

async fn history(session: Option<Session>, subject: ComponentId, timeout: Duration) -> TaskResult {
    let (structure, module) = (&subject.structure, &subject.component.module);
    let history = match session {
        Some(session) => session::client::history(&session, structure, module, 1, timeout).await,
        None => {
            let broken_off = Some(QueryError::NotAsked(NO_NETWORK.to_owned()));
            ModuleHistory { broken_off, ..ModuleHistory::new(structure, module, 1) }
        }
    };
    TaskResult::History(subject, Box::new(history))
}
