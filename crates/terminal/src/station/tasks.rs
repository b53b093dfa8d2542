//! Orders and queries to modules, each a task whose result is queued here.

use std::time::Duration;

use observer::{
    ComponentId, DivergenceFeed, ModuleHistory, ModuleId, OrderOutcome, OrderRequest, QueryError,
};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::{AbortHandle, JoinSet};
use vocabulary::{FaultTransition, FreezeFrame};
use zenoh::Session;

use crate::model::effect::{ModelEffect, TaskResult};

/// Capacity of the result queue.
const QUEUE: usize = 256;

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
        let (outlet, timeout) = (self.outlet.clone(), self.timeout);
        match effect {
            ModelEffect::Listen(whom) => self.listen(whom, session),
            ModelEffect::Order(request) => {
                self.tasks.spawn(async move {
                    let outcome = order(session, &request, timeout).await;
                    let _ = outlet.send(TaskResult::Order(request, outcome)).await;
                });
            }
            ModelEffect::Frame(fault) => {
                self.tasks.spawn(async move {
                    let frame = frame(session, &fault, timeout).await.map(Box::new);
                    let _ = outlet.send(TaskResult::Frame(ComponentId::of(&fault), frame)).await;
                });
            }
            ModelEffect::Identification(subject) => {
                self.tasks.spawn(async move {
                    let _ = outlet.send(identification(session, subject, timeout).await).await;
                });
            }
            ModelEffect::History(subject) => {
                self.tasks.spawn(async move {
                    let _ = outlet.send(history(session, subject, timeout).await).await;
                });
            }
            ModelEffect::Suspend | ModelEffect::Quit => {}
        }
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

fn no_network() -> String {
    "the network is not connected".to_owned()
}

async fn order(
    session: Option<Session>,
    request: &OrderRequest,
    timeout: Duration,
) -> OrderOutcome {
    let Some(session) = session else { return OrderOutcome::not_sent(&no_network()) };
    observer::order(&session, request, timeout).await.into()
}

/// The freeze frame of a component's present fault.
async fn frame(
    session: Option<Session>,
    fault: &FaultTransition,
    timeout: Duration,
) -> Result<FreezeFrame, String> {
    let session = session.ok_or_else(no_network)?;
    observer::freeze_frame_of(&session, fault, timeout).await
}

fn why(error: QueryError) -> String {
    match error {
        QueryError::Unanswered(_) => "its module does not provide one".to_owned(),
        other => other.to_string(),
    }
}

async fn identification(
    session: Option<Session>,
    subject: ComponentId,
    timeout: Duration,
) -> TaskResult {
    let Some(session) = session else {
        return TaskResult::Identification(subject, Err(no_network()));
    };
    let found =
        observer::identification(&session, &subject.structure, &subject.component, timeout).await;
    TaskResult::Identification(subject, found.map(|found| found.map(Box::new)).map_err(why))
}

async fn history(session: Option<Session>, subject: ComponentId, timeout: Duration) -> TaskResult {
    let (structure, module) = (&subject.structure, &subject.component.module);
    let history = match session {
        Some(session) => observer::history(&session, structure, module, 1, timeout).await,
        None => {
            let broken_off = Some(QueryError::NotAsked(no_network()));
            ModuleHistory { broken_off, ..ModuleHistory::new(structure, module, 1) }
        }
    };
    TaskResult::History(subject, Box::new(history))
}
