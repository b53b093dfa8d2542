//! Orders and questions, each a task; their answers come back here.

use std::time::Duration;

use observer::{Command, DivergenceFeed, ModuleHistory, OrderOutcome, QueryError};
use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::task::{AbortHandle, JoinSet};
use vocabulary::{FaultTransition, FreezeFrame, OperatorName};
use zenoh::Session;

use crate::model::exchange::{Answer, Effect, Given};
use crate::model::{Subject, Whose};
use crate::settings::Settings;

/// Answers that may wait.
const QUEUE: usize = 256;

/// Everything that is under way. It ends when it is dropped.
pub(super) struct Errands {
    operator: Option<OperatorName>,
    timeout: Duration,
    tasks: JoinSet<()>,
    listening: Option<AbortHandle>,
    outlet: Sender<Answer>,
    inbox: Receiver<Answer>,
}

impl Errands {
    pub(super) fn new(settings: &Settings) -> Self {
        let (outlet, inbox) = channel(QUEUE);
        let operator = settings.issuer.as_ref().ok().and_then(|issuer| issuer.operator.clone());
        let (timeout, tasks) = (settings.timeout, JoinSet::new());
        Self { operator, timeout, tasks, listening: None, outlet, inbox }
    }

    /// The next answer; may be given up at any time.
    pub(super) async fn next(&mut self) -> Option<Answer> {
        self.inbox.recv().await
    }

    /// Sends somebody. Does not wait.
    pub(super) fn send(&mut self, effect: Effect, session: Option<Session>) {
        while self.tasks.try_join_next().is_some() {}
        let (outlet, timeout) = (self.outlet.clone(), self.timeout);
        match effect {
            Effect::Listen(whom) => self.listen(whom, session),
            Effect::Order(given) => {
                let command = Command { kind: given.kind, operator: self.operator.clone() };
                self.tasks.spawn(async move {
                    let outcome = order(session, &given, &command, timeout).await;
                    let _ = outlet.send(Answer::Order(given, outcome)).await;
                });
            }
            Effect::Frame(fault) => {
                self.tasks.spawn(async move {
                    let frame = frame(session, &fault, timeout).await.map(Box::new);
                    let _ = outlet.send(Answer::Frame(Subject::of(&fault), frame)).await;
                });
            }
            Effect::Identification(subject) => {
                self.tasks.spawn(async move {
                    let _ = outlet.send(identification(session, subject, timeout).await).await;
                });
            }
            Effect::History(subject) => {
                self.tasks.spawn(async move {
                    let _ = outlet.send(history(session, subject, timeout).await).await;
                });
            }
            Effect::Suspend | Effect::Quit => {}
        }
    }

    /// A diagnoser publishes its divergences only as long as somebody listens.
    fn listen(&mut self, whom: Option<Whose>, session: Option<Session>) {
        if let Some(former) = self.listening.take() {
            former.abort();
        }
        let (Some(Whose { structure: Some(structure), module }), Some(session)) = (whom, session)
        else {
            return;
        };
        let outlet = self.outlet.clone();
        let task = self.tasks.spawn(async move {
            let Ok(mut feed) = DivergenceFeed::open(&session, &structure, &module).await else {
                return;
            };
            while let Some(message) = feed.next().await {
                if outlet.send(Answer::Divergences(Box::new(message))).await.is_err() {
                    return;
                }
            }
        });
        self.listening = Some(task);
    }
}

fn no_network() -> String {
    "there is no network".to_owned()
}

async fn order(
    session: Option<Session>,
    given: &Given,
    command: &Command,
    timeout: Duration,
) -> OrderOutcome {
    let Some(session) = session else { return OrderOutcome::not_sent(&no_network()) };
    let Subject { structure, component } = &given.subject;
    observer::order(&session, structure, &component.module, command, &given.order, timeout)
        .await
        .into()
}

/// The freeze frame of the fault that a component has.
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
        QueryError::Unanswered(_) => "its module gives none".to_owned(),
        other => other.to_string(),
    }
}

async fn identification(session: Option<Session>, subject: Subject, timeout: Duration) -> Answer {
    let Some(session) = session else { return Answer::Identification(subject, Err(no_network())) };
    let found =
        observer::identification(&session, &subject.structure, &subject.component, timeout).await;
    Answer::Identification(subject, found.map(|found| found.map(Box::new)).map_err(why))
}

async fn history(session: Option<Session>, subject: Subject, timeout: Duration) -> Answer {
    let (structure, module) = (&subject.structure, &subject.component.module);
    let history = match session {
        Some(session) => observer::history(&session, structure, module, 1, timeout).await,
        None => {
            let broken_off = Some(QueryError::NotAsked(no_network()));
            ModuleHistory { broken_off, ..ModuleHistory::new(structure, module, 1) }
        }
    };
    Answer::History(subject, Box::new(history))
}
