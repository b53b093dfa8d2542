//! Opens the session, listens, asks for the present states every other second, and shows what comes of it.

use std::fmt::Display;
use std::future::Future;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tokio::sync::mpsc::{Sender, channel};
use tokio::sync::{broadcast, watch};
use tokio::task::JoinSet;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep};
use vocabulary::{
    ComponentPath, FaultTransition, Key, ModuleName, ModuleStatus, StructureName, Topic,
    keys::Watched,
};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};

use crate::feed::Feed;
use crate::request::read;
use crate::view::{Event, NetworkState, QueryError, Scene, Structures};

/// From one failure to open a session to the next attempt.
const OPEN_AGAIN_AFTER: Duration = Duration::from_secs(2);
/// How often a scene is made at most.
const SHOW_EVERY: Duration = Duration::from_millis(100);
/// How often a scene is made at least: ages grow, and what is not heard becomes silent.
const SHOW_AT_LEAST_EVERY: Duration = Duration::from_secs(1);
/// How often present states are asked for, which say how components compare with their references.
const ASK_EVERY: Duration = Duration::from_secs(2);
/// How long answers are waited for.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);
/// Statuses and answers that may wait.
const QUEUE: usize = 1024;

/// What is heard beside the feed.
enum Heard {
    Status(Box<ModuleStatus>),
    /// The state of a component, and the process that answered.
    State(Box<FaultTransition>, Option<String>),
    Refusal(String),
    /// An answer that cannot be read: its key, and what is wrong with it.
    Unreadable(String, String),
    /// No more answers come.
    Answered,
}

pub(super) async fn run<F, E>(
    (open, reopens): (impl Fn() -> F, bool),
    structure: Option<StructureName>,
    mut show: Show,
    sessions: watch::Sender<Option<Session>>,
) where
    F: Future<Output = Result<Session, E>> + Send + 'static,
    E: Display + Send + 'static,
{
    loop {
        show.now();
        // A client waits for its router without yielding, hence the task of its own.
        let network = match tokio::spawn(open()).await {
            Ok(Ok(session)) => {
                let _ = sessions.send(Some(session.clone()));
                listen(&session, structure.as_ref(), &mut show)
                    .await
                    .map_or_else(NetworkState::Failed, |()| NetworkState::Closed)
            }
            Ok(Err(error)) => NetworkState::Failed(error.to_string()),
            Err(error) => NetworkState::Failed(error.to_string()),
        };
        show.known.network(network);
        show.now();
        let _ = sessions.send(None);
        if !reopens {
            return;
        }
        sleep(OPEN_AGAIN_AFTER).await;
    }
}

/// What is known, and where it is shown.
pub(super) struct Show {
    known: Structures,
    /// Whether modules are asked for the states of their components.
    asks: bool,
    scenes: watch::Sender<Arc<Scene>>,
    events: broadcast::Sender<Arc<Event>>,
    number: u64,
    shown: Instant,
    changed: bool,
}

impl Show {
    pub(super) fn new(
        structure: Option<&StructureName>,
        expected: Vec<ModuleName>,
        asks: bool,
        scenes: watch::Sender<Arc<Scene>>,
        events: broadcast::Sender<Arc<Event>>,
    ) -> Self {
        let known = Structures::new(structure, expected);
        Self { known, asks, scenes, events, number: 0, shown: Instant::now(), changed: true }
    }

    fn now(&mut self) {
        self.number += 1;
        self.shown = Instant::now();
        self.changed = false;
        let scene = self.known.scene(self.number, unix_ns());
        self.scenes.send_replace(Arc::new(scene));
    }

    fn if_due(&mut self) {
        if self.changed || self.shown.elapsed() >= SHOW_AT_LEAST_EVERY {
            self.now();
        }
    }

    fn hear(&mut self, heard: Heard) {
        match heard {
            Heard::Status(status) => self.known.status(*status, unix_ns()),
            Heard::State(state, process) => self.known.state(*state, process, unix_ns()),
            Heard::Refusal(problem) => self.known.problem(problem),
            Heard::Unreadable(key, problem) => self.known.unreadable(&key, &problem, unix_ns()),
            Heard::Answered => self.known.answered(),
        }
        self.changed = true;
    }
}

/// Until the session ends.
async fn listen(
    session: &Session,
    structure: Option<&StructureName>,
    show: &mut Show,
) -> Result<(), String> {
    let (outlet, mut heard) = channel(QUEUE);
    let mut feed = Feed::open(session, structure).await.map_err(|error| error.to_string())?;
    let statuses = statuses(session, structure, outlet.clone());
    let _subscriber = statuses.await.map_err(|error| error.to_string())?;
    show.known.network(NetworkState::Open);
    show.now();
    let mut answering = JoinSet::new();
    let mut ask_at = Instant::now();
    let mut ticks = interval(SHOW_EVERY);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            news = feed.next() => match news {
                Some(news) => {
                    let event = show.known.news(news, unix_ns());
                    // Views that stay open look at scenes alone.
                    let _ = show.events.send(event);
                    show.changed = true;
                    // How it compares with its reference now.
                    ask_at = ask_at.min(Instant::now() + SHOW_EVERY);
                }
                None => return Ok(()),
            },
            Some(heard) = heard.recv() => show.hear(heard),
            Some(_) = answering.join_next() => {}
            _ = ticks.tick() => show.if_due(),
        }
        if show.asks && answering.is_empty() && Instant::now() >= ask_at {
            ask_at = Instant::now() + ASK_EVERY;
            show.known.asked();
            answering.spawn(ask(session.clone(), structure.cloned(), outlet.clone()));
        }
    }
}

/// Queries the state of every component, and passes answers on as they come.
async fn ask(session: Session, structure: Option<StructureName>, outlet: Sender<Heard>) {
    let replies = session
        .get(Watched { structure: structure.as_ref(), module: None }.faults())
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(ANSWER_WITHIN)
        .await;
    if let Ok(replies) = replies {
        while let Ok(reply) = replies.recv_async().await {
            let heard = match state_in(&reply) {
                Ok(state) => {
                    let process = reply.replier_id().map(|replier| replier.zid().to_string());
                    Heard::State(Box::new(state), process)
                }
                Err(refusal @ QueryError::Refused(_)) => Heard::Refusal(refusal.to_string()),
                Err(problem) => match reply.result() {
                    Ok(sample) => {
                        Heard::Unreadable(sample.key_expr().to_string(), problem.to_string())
                    }
                    Err(_) => continue,
                },
            };
            // The receiver is gone with the session.
            let _ = outlet.send(heard).await;
        }
    }
    let _ = outlet.send(Heard::Answered).await;
}

/// The state in a reply, if it came on the key of the component that it is about.
fn state_in(reply: &Reply) -> Result<FaultTransition, QueryError> {
    let transition: FaultTransition = read(reply, ANSWER_WITHIN)?;
    let ComponentPath { module, component } = transition.component.clone();
    let topic = Topic::Fault(component);
    let key = Key::of_module(&transition.structure, &transition.module, topic).to_string();
    let is_own = reply.result().is_ok_and(|sample| sample.key_expr().as_str() == key);
    if module != transition.module || !is_own {
        return Err(QueryError::Senseless(format!("a state of `{}`", transition.component)));
    }
    Ok(transition)
}

async fn statuses(
    session: &Session,
    structure: Option<&StructureName>,
    outlet: Sender<Heard>,
) -> zenoh::Result<Subscriber<()>> {
    let callback = move |sample: zenoh::sample::Sample| {
        let key = sample.key_expr().as_str().parse::<Key>();
        let Ok(Key::Module { structure, module, topic: Topic::Status }) = key else { return };
        let Ok(status) = vocabulary::decode::<ModuleStatus>(&sample.payload().to_bytes()) else {
            return;
        };
        if status.structure == structure && status.module == module {
            // One that finds no room is followed by another.
            let _ = outlet.try_send(Heard::Status(Box::new(status)));
        }
    };
    let watched = Watched { structure, module: None };
    session.declare_subscriber(watched.statuses()).callback(callback).await
}

pub(super) fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
