//! Opens the session, listens, asks for the present states every other second, and shows what comes of it.

use std::fmt::Display;
use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use names::{ModuleName, StructureName};
use tokio::sync::mpsc::{Receiver, channel};
use tokio::sync::watch::Sender;
use tokio::task::JoinSet;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep};
use wire::keys::Watched;
use wire::{Key, ModuleStatus, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use super::scene::{NetworkState, Scene};
use super::stage::Stage;
use crate::feed::Feed;
use crate::picture::{StateReply, states, unix_ns};

/// From one failure to open a session to the next attempt.
const OPEN_AGAIN_AFTER: Duration = Duration::from_secs(2);
/// How often a scene is made at most.
const SHOW_EVERY: Duration = Duration::from_millis(100);
/// How often a scene is made at least: ages grow, and what is not heard becomes silent.
const SHOW_AT_LEAST_EVERY: Duration = Duration::from_secs(1);
/// How often present states are asked for, which say how components stand to their references.
const ASK_EVERY: Duration = Duration::from_secs(2);
/// How long answers are waited for.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);
/// Statuses that may wait.
const QUEUE: usize = 1024;

pub(super) async fn run<F, E>(
    open: impl Fn() -> F,
    (structure, expected): (Option<StructureName>, Vec<ModuleName>),
    scenes: Sender<Arc<Scene>>,
    sessions: Sender<Option<Session>>,
) where
    F: Future<Output = Result<Session, E>> + Send + 'static,
    E: Display + Send + 'static,
{
    let stage = Stage::new(structure.as_ref(), expected);
    let mut show = Show { stage, scenes, number: 0, shown: Instant::now(), changed: true };
    loop {
        show.now();
        // A client waits for its router without yielding, hence the task of its own.
        match tokio::spawn(open()).await {
            Ok(Ok(session)) => {
                show.stage.network(NetworkState::Open);
                let _ = sessions.send(Some(session.clone()));
                if let Err(problem) = listen(&session, structure.as_ref(), &mut show).await {
                    show.stage.network(NetworkState::Failed(problem));
                } else {
                    show.stage.network(NetworkState::Closed);
                }
            }
            Ok(Err(error)) => show.stage.network(NetworkState::Failed(error.to_string())),
            Err(error) => show.stage.network(NetworkState::Failed(error.to_string())),
        }
        show.now();
        let _ = sessions.send(None);
        sleep(OPEN_AGAIN_AFTER).await;
    }
}

/// Where scenes are shown.
struct Show {
    stage: Stage,
    scenes: Sender<Arc<Scene>>,
    number: u64,
    shown: Instant,
    changed: bool,
}

impl Show {
    fn now(&mut self) {
        self.number += 1;
        self.shown = Instant::now();
        self.changed = false;
        let scene = self.stage.scene(self.number, unix_ns());
        self.scenes.send_replace(Arc::new(scene));
    }

    fn if_due(&mut self) {
        if self.changed || self.shown.elapsed() >= SHOW_AT_LEAST_EVERY {
            self.now();
        }
    }
}

/// Until the session ends.
async fn listen(
    session: &Session,
    structure: Option<&StructureName>,
    show: &mut Show,
) -> Result<(), String> {
    let mut feed = Feed::open(session, structure).await.map_err(|error| error.to_string())?;
    let (_subscriber, mut statuses) =
        statuses(session, structure).await.map_err(|error| error.to_string())?;
    let mut answering = JoinSet::new();
    let mut ask_at = Instant::now();
    let mut ticks = interval(SHOW_EVERY);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            news = feed.next() => match news {
                Some(news) => {
                    show.stage.news(news, unix_ns());
                    show.changed = true;
                    // How it stands to its reference now.
                    ask_at = ask_at.min(Instant::now() + SHOW_EVERY);
                }
                None => return Ok(()),
            },
            Some(status) = statuses.recv() => {
                show.stage.status(status, unix_ns());
                show.changed = true;
            }
            Some(answers) = answering.join_next() => {
                show.stage.forget_processes();
                for answer in answers.unwrap_or_default() {
                    match answer {
                        StateReply::State(state, process) => {
                            show.stage.state(*state, process, unix_ns());
                        }
                        StateReply::Unreadable(state) => show.stage.unreadable(&state, unix_ns()),
                        // The feed complains of it.
                        StateReply::Problem(_) => {}
                    }
                }
                show.changed = true;
            }
            _ = ticks.tick() => show.if_due(),
        }
        if answering.is_empty() && Instant::now() >= ask_at {
            ask_at = Instant::now() + ASK_EVERY;
            answering.spawn(ask(session.clone(), structure.cloned()));
        }
    }
}

/// Who does not answer is not heard.
async fn ask(session: Session, structure: Option<StructureName>) -> Vec<StateReply> {
    states(&session, structure.as_ref(), ANSWER_WITHIN).await.unwrap_or_default()
}

async fn statuses(
    session: &Session,
    structure: Option<&StructureName>,
) -> zenoh::Result<(Subscriber<()>, Receiver<ModuleStatus>)> {
    let (inbox, outlet) = channel(QUEUE);
    let subscriber = session
        .declare_subscriber(Watched { structure, module: None }.statuses())
        .callback(move |sample| {
            let key = sample.key_expr().as_str().parse::<Key>();
            let Ok(Key::Module { structure, module, topic: Topic::Status }) = key else { return };
            let Ok(status) = wire::decode::<ModuleStatus>(&sample.payload().to_bytes()) else {
                return;
            };
            if status.structure == structure && status.module == module {
                // One that finds no room is followed by another.
                let _ = inbox.try_send(status);
            }
        })
        .await?;
    Ok((subscriber, outlet))
}
