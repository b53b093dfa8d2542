//! A structure as it is at every moment, for views that stay open: the page, the terminal view.
//!
//! | file | what |
//! |---|---|
//! | `scene` | what a view shows: modules, components, the latest events |
//! | `stage` | what is known, and the scene that follows from it: a plain value |
//! | `task` | what keeps it up to date, from the opening of the session on |

mod scene;
mod stage;
mod task;

use std::fmt::Display;
use std::future::Future;
use std::sync::Arc;

use names::{ModuleName, StructureName};
use tokio::sync::watch::{Receiver, channel};
use tokio::task::JoinSet;
use zenoh::Session;

pub use scene::{Event, LiveModule, NetworkState, Scene};

/// Keeps a scene up to date as long as it lives, whether or not there is a network and anybody on it. Those who look at
/// it ask nobody anything.
#[derive(Debug)]
pub struct Live {
    scene: Receiver<Arc<Scene>>,
    session: Receiver<Option<Session>>,
    _task: JoinSet<()>,
}

impl Live {
    /// Starts; `open` is called until there is a session. `expected` are modules that should be there.
    pub fn start<F, E>(
        open: impl Fn() -> F + Send + 'static,
        structure: Option<StructureName>,
        expected: Vec<ModuleName>,
    ) -> Self
    where
        F: Future<Output = Result<Session, E>> + Send + 'static,
        E: Display + Send + 'static,
    {
        let (scenes, scene) = channel(Arc::default());
        let (sessions, session) = channel(None);
        let mut task = JoinSet::new();
        task.spawn(task::run(open, (structure, expected), scenes, sessions));
        Self { scene, session, _task: task }
    }

    /// What there is to see now.
    #[must_use]
    pub fn scene(&self) -> Arc<Scene> {
        self.scene.borrow().clone()
    }

    /// The scenes as they change, ten a second at most; whoever is slow gets the latest.
    #[must_use]
    pub fn scenes(&self) -> Receiver<Arc<Scene>> {
        self.scene.clone()
    }

    /// The session, once there is one: for orders, histories, freeze frames.
    #[must_use]
    pub fn session(&self) -> Option<Session> {
        self.session.borrow().clone()
    }
}
