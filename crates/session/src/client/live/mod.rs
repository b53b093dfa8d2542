//! Live observation of a structure: every view observes through this module.
//!
//! | file | what |
//! |---|---|
//! | `present` | takes one snapshot, once every module has answered |
//! | `task` | subscribes, queries, and passes the messages to [`Structures`](observer::Structures) |

mod present;
mod task;

use std::convert::Infallible;
use std::fmt::Display;
use std::future::{Future, ready};
use std::sync::Arc;

use tokio::sync::broadcast::{self, error::RecvError};
use tokio::sync::watch::{self, channel};
use tokio::task::JoinSet;
use vocabulary::{ModuleName, StructureName};
use zenoh::Session;

use crate::client::presence::AttendanceError;
use observer::{NetworkState, News, ObservedEvent, Scene};
use task::Show;

pub use present::{attendance, present};

/// Capacity of the event queue.
const QUEUE: usize = 4096;

/// Keeps a scene up to date until it is dropped, with or without a network or modules.
#[derive(Debug)]
pub struct Live {
    scene: watch::Receiver<Arc<Scene>>,
    session: watch::Receiver<Option<Session>>,
    events: Option<broadcast::Receiver<Arc<ObservedEvent>>>,
    _task: JoinSet<()>,
}

impl Live {
    /// Starts observing; retries `open` until it returns a session. `expected` lists modules that should be running.
    pub fn start<F, E>(
        open: impl Fn() -> F + Send + 'static,
        structure: Option<StructureName>,
        expected: Vec<ModuleName>,
    ) -> Self
    where
        F: Future<Output = Result<Session, E>> + Send + 'static,
        E: Display + Send + 'static,
    {
        let live = Self::run((open, true), structure, expected, true);
        Self { events: None, ..live }
    }

    /// Starts observing over a session, and queues events until the caller takes them: every event published after this
    /// returns.
    ///
    /// # Errors
    /// Zenoh cannot declare a subscriber.
    pub async fn over(
        session: &Session,
        structure: Option<StructureName>,
        expected: Vec<ModuleName>,
    ) -> Result<Self, AttendanceError> {
        Self::on(session, structure, expected, true).await
    }

    /// Like [`Live::over`], for events alone: modules are not queried for the states of their components.
    ///
    /// # Errors
    /// Zenoh cannot declare a subscriber.
    pub async fn events(
        session: &Session,
        structure: Option<StructureName>,
    ) -> Result<Self, AttendanceError> {
        Self::on(session, structure, Vec::new(), false).await
    }

    async fn on(
        session: &Session,
        structure: Option<StructureName>,
        expected: Vec<ModuleName>,
        asks: bool,
    ) -> Result<Self, AttendanceError> {
        let session = session.clone();
        let open = move || ready(Ok::<_, Infallible>(session.clone()));
        let live = Self::run((open, false), structure, expected, asks);
        live.network().await?;
        Ok(live)
    }

    /// Waits until the session is open.
    async fn network(&self) -> Result<(), AttendanceError> {
        let mut scenes = self.scenes();
        let opened = scenes.wait_for(|scene| scene.network != NetworkState::Opening).await;
        match opened.map(|scene| scene.network.clone()) {
            Ok(NetworkState::Failed(reason)) => Err(AttendanceError::Network(reason)),
            Ok(NetworkState::Closed) | Err(_) => {
                Err(AttendanceError::Network("the session was closed".to_owned()))
            }
            Ok(NetworkState::Open | NetworkState::CutOff(_) | NetworkState::Opening) => Ok(()),
        }
    }

    fn run<F, E>(
        (open, reopens): (impl Fn() -> F + Send + 'static, bool),
        structure: Option<StructureName>,
        expected: Vec<ModuleName>,
        asks: bool,
    ) -> Self
    where
        F: Future<Output = Result<Session, E>> + Send + 'static,
        E: Display + Send + 'static,
    {
        let (scenes, scene) = channel(Arc::default());
        let (sessions, session) = channel(None);
        let (outlet, events) = broadcast::channel(QUEUE);
        let show = Show::new(structure.as_ref(), expected, asks, scenes, outlet);
        let mut task = JoinSet::new();
        task.spawn(task::run((open, reopens), structure, show, sessions));
        Self { scene, session, events: Some(events), _task: task }
    }

    /// The present scene.
    #[must_use]
    pub fn scene(&self) -> Arc<Scene> {
        self.scene.borrow().clone()
    }

    /// A channel of scenes, updated at most ten times a second; a slow view receives the latest.
    #[must_use]
    pub fn scenes(&self) -> watch::Receiver<Arc<Scene>> {
        self.scene.clone()
    }

    /// The next event of [`Live::over`] or [`Live::events`], in order; what is so at present comes first: processes, phases
    /// and alarms. `None` once the session is closed.
    pub async fn next_event(&mut self) -> Option<Arc<ObservedEvent>> {
        let event = self.events.as_mut()?.recv().await;
        match event {
            Ok(event) => Some(event),
            Err(RecvError::Closed) => None,
            Err(RecvError::Lagged(count)) => {
                let (number, news) = (0, News::Lost { count });
                Some(Arc::new(ObservedEvent { number, time_unix_ns: task::unix_ns(), news }))
            }
        }
    }

    /// The session, once it is open: for orders, histories and freeze frames.
    #[must_use]
    pub fn session(&self) -> Option<Session> {
        self.session.borrow().clone()
    }
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use super::*;

    #[tokio::test]
    async fn before_anything_is_heard_the_expected_modules_are_shown() {
        let module: ModuleName = "m9".parse().unwrap();
        let open = pending::<Result<Session, Infallible>>;
        let live = Live::start(open, Some("tower".parse().unwrap()), vec![module.clone()]);
        let scene = live.scene();
        assert_eq!(scene.network, NetworkState::Opening);
        assert!(scene.modules.iter().any(|view| view.module == module), "{scene:?}");
    }
}
