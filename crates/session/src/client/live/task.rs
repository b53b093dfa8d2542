//! Opens the session, subscribes, fetches missed transitions, queries the present states every other second, and
//! publishes the resulting scenes.

use std::fmt::Display;
use std::future::Future;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tokio::sync::mpsc::{Receiver, Sender, channel};
use tokio::sync::{broadcast, watch};
use tokio::task::JoinSet;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep};
use vocabulary::{
    ComponentPath, FaultTransition, Key, ModuleName, StructureName, Topic, keys::Watched,
};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::query::Reply;
use zenoh::sample::Sample;

use crate::client::feed_queries::{ask, ask_all, message, token};
use crate::client::request::{self, Replies, read};
use observer::feed::{EventFeed, Incoming};
use observer::{NetworkState, News, ObservedEvent, QueryError, Scene, Structures};

/// Pause before the next attempt to open a session.
const OPEN_AGAIN_AFTER: Duration = Duration::from_secs(2);
/// Shortest interval between scenes.
const SHOW_EVERY: Duration = Duration::from_millis(100);
/// Longest interval between scenes: ages grow, and a module that sends nothing becomes silent.
const SHOW_AT_LEAST_EVERY: Duration = Duration::from_secs(1);
/// Interval of queries for present states, which tell how components compare with their references.
const ASK_EVERY: Duration = Duration::from_secs(2);
/// Timeout of such a query.
const ANSWER_WITHIN: Duration = Duration::from_secs(2);
/// Capacity of the message queue.
const QUEUE: usize = 4096;
/// Questions about missed transitions that may be pending.
const QUESTIONS: usize = 8;

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
        // Opening a client session blocks until the router answers, hence a separate task.
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
        show.known.network(network, unix_ns());
        show.now();
        let _ = sessions.send(None);
        if !reopens {
            return;
        }
        sleep(OPEN_AGAIN_AFTER).await;
    }
}

/// What is known, and the channels that publish it.
pub(super) struct Show {
    known: Structures,
    /// Whether to query modules for the states of their components.
    asks: bool,
    scenes: watch::Sender<Arc<Scene>>,
    events: broadcast::Sender<Arc<ObservedEvent>>,
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
        events: broadcast::Sender<Arc<ObservedEvent>>,
    ) -> Self {
        let known = Structures::new(structure, expected);
        let shown = Instant::now();
        let mut show = Self { known, asks, scenes, events, number: 0, shown, changed: true };
        // Before anything is heard, the expected modules are unknown.
        show.now();
        show
    }

    fn now(&mut self) {
        self.number += 1;
        self.shown = Instant::now();
        self.changed = false;
        let now = unix_ns();
        self.known.forget(now);
        let scene = self.known.scene(self.number, now);
        self.scenes.send_replace(Arc::new(scene));
    }

    fn if_due(&mut self) {
        if self.changed || self.shown.elapsed() >= SHOW_AT_LEAST_EVERY {
            self.now();
        }
    }

    fn news(&mut self, news: Vec<News>) {
        for news in news {
            let event = self.known.news(news, unix_ns());
            // Views that stay open receive scenes only, so there may be no receiver.
            let _ = self.events.send(event);
            self.changed = true;
        }
    }

    /// Records that the connection was lost, or is there again.
    fn connection(&mut self, news: &News) {
        match news {
            News::Connection { connected: true } => {
                self.known.network(NetworkState::Open, unix_ns());
            }
            News::Connection { connected: false } => {
                self.known.network(NetworkState::CutOff(unix_ns()), unix_ns());
            }
            _ => {}
        }
    }

    /// Handles a reply to the query of states.
    fn reply(&mut self, reply: &Reply) {
        match (state_in(reply), reply.result()) {
            (Ok(state), _) => {
                let process = reply.replier_id().map(|replier| replier.zid().to_string());
                self.known.state(state, process, unix_ns());
            }
            (Err(refusal @ QueryError::Refused(_)), _) => self.known.problem(refusal.to_string()),
            (Err(problem), Ok(sample)) => {
                let key = sample.key_expr().as_str();
                self.known.unreadable(key, &problem.to_string(), unix_ns());
            }
            (Err(_), Err(_)) => return,
        }
        self.changed = true;
    }

    /// Handles the end of the replies.
    fn answered(&mut self) {
        self.known.answered();
        self.changed = true;
    }
}

/// Receives messages until the session ends.
async fn listen(
    session: &Session,
    structure: Option<&StructureName>,
    show: &mut Show,
) -> Result<(), String> {
    let mut inbox = Inbox::open(session, structure).await.map_err(|error| error.to_string())?;
    let mut feed = EventFeed::default();
    show.known.network(NetworkState::Open, unix_ns());
    show.now();
    let mut asked = JoinSet::new();
    asked.spawn(ask_all(session.clone(), structure.cloned()));
    let mut replies = None;
    let mut ask_at = Instant::now();
    let mut ticks = interval(SHOW_EVERY);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let now = std::time::Instant::now();
        let news = tokio::select! {
            incoming = inbox.messages.recv() => {
                let Some(incoming) = incoming else { return Ok(()) };
                if let Incoming::Status(status) = &incoming {
                    show.known.status((**status).clone(), unix_ns());
                    show.changed = true;
                }
                let mut news = inbox.lost();
                news.extend(feed.published(incoming, now));
                news
            }
            Some(Ok(answer)) = asked.join_next() => feed.answered(answer, now),
            reply = next(replies.as_ref()) => {
                match reply {
                    Some(reply) => show.reply(&reply),
                    None => {
                        replies = None;
                        show.answered();
                    }
                }
                continue;
            }
            _ = ticks.tick() => {
                let news = feed.connection(is_connected(session).await, now);
                for news in &news {
                    show.connection(news);
                }
                show.if_due();
                news
            }
        };
        if !news.is_empty() {
            // Query soon how the component compares with its reference now.
            ask_at = ask_at.min(Instant::now() + SHOW_EVERY);
        }
        show.news(news);
        while asked.len() < QUESTIONS
            && let Some(question) = feed.question(std::time::Instant::now())
        {
            asked.spawn(ask(session.clone(), question));
        }
        if show.asks && replies.is_none() && Instant::now() >= ask_at {
            ask_at = Instant::now() + ASK_EVERY;
            show.known.asked();
            let states = Watched { structure, module: None }.faults();
            replies = request::ask_all(session, states, ANSWER_WITHIN).await.ok();
            if replies.is_none() {
                show.answered();
            }
        }
    }
}

/// Whether the session is connected to any process.
async fn is_connected(session: &Session) -> bool {
    let info = session.info();
    info.peers_zid().await.next().is_some() || info.routers_zid().await.next().is_some()
}

/// Queues published messages; closed with the session.
struct Inbox {
    messages: Receiver<Incoming>,
    /// Messages dropped because the queue was full, since this was last reported.
    lost: Arc<AtomicU64>,
    _subscribers: Vec<Subscriber<()>>,
}

impl Inbox {
    /// Subscribes before any query, so that no message published after an answer is lost.
    async fn open(session: &Session, structure: Option<&StructureName>) -> zenoh::Result<Self> {
        let (sender, messages) = channel(QUEUE);
        let lost = Arc::new(AtomicU64::new(0));
        let watched = Watched { structure, module: None };
        let mut subscribers = Vec::new();
        let published =
            [watched.faults(), watched.identifications(), watched.phases(), watched.statuses()];
        for expression in published {
            let callback = hand_to(sender.clone(), lost.clone(), message);
            subscribers.push(session.declare_subscriber(expression).callback(callback).await?);
        }
        let tokens = session.liveliness().declare_subscriber(watched.tokens()).history(true);
        subscribers.push(tokens.callback(hand_to(sender, lost.clone(), token)).await?);
        Ok(Self { messages, lost, _subscribers: subscribers })
    }

    /// Reports lost messages, if any.
    fn lost(&self) -> Vec<News> {
        let count = self.lost.swap(0, Ordering::Relaxed);
        (count > 0).then_some(News::Lost { count }).into_iter().collect()
    }
}

/// Queues a message or drops it: Zenoh's threads must not block.
fn hand_to(
    sender: Sender<Incoming>,
    lost: Arc<AtomicU64>,
    read: impl Fn(&Sample) -> Option<Incoming> + Send + Sync + 'static,
) -> impl Fn(Sample) + Send + Sync + 'static {
    move |sample| {
        if let Some(incoming) = read(&sample)
            && sender.try_send(incoming).is_err()
        {
            lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The next reply; `None` after the last.
async fn next(replies: Option<&Replies>) -> Option<Reply> {
    match replies {
        Some(replies) => replies.recv_async().await.ok(),
        None => std::future::pending().await,
    }
}

/// Decodes the state in a reply, which must be about the component in the reply's key.
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

pub(super) fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
