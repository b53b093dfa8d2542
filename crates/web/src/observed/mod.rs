//! The observed structures: the scene, and answers of modules, fetched once for all pages. A hundred open pages load a
//! module no more than one.
//!
//! | file | what |
//! |---|---|
//! | `answers` | answers of modules, kept for a moment |
//! | `journals` | the recent part of a module's journal |
//! | `frames` | the freeze frame of a component's fault |
//! | `traces` | a module's divergences of the last minute |

mod answers;
mod frames;
mod journals;
mod traces;

use std::sync::Arc;
use std::time::Duration;

use observer::{Live, ModuleHistory, Scene};
use vocabulary::{ModuleName, StructureName};
use zenoh::Session;

use crate::hub::{Hub, LINGER};
use answers::Answers;

pub(crate) use frames::Frame;
pub(crate) use traces::Traces;

/// How long answers are reused: a journal grows, and a frame may be recorded a moment later.
const KEEP_JOURNAL: Duration = Duration::from_secs(2);
const KEEP_FRAME: Duration = Duration::from_secs(3);

/// The observed structures.
#[derive(Debug)]
pub(crate) struct Observed {
    pub(crate) live: Live,
    /// Timeout for answers of modules.
    pub(crate) timeout: Duration,
    /// The divergences of each module whose pages are viewed.
    traces: Hub<(StructureName, ModuleName), Arc<Traces>>,
    journals: Answers<(StructureName, ModuleName), Arc<ModuleHistory>>,
    frames: Answers<String, Frame>,
}

impl Observed {
    pub(crate) fn new(live: Live, timeout: Duration) -> Self {
        let (journals, frames) = (Answers::new(KEEP_JOURNAL), Answers::new(KEEP_FRAME));
        Self { live, timeout, traces: Hub::new(LINGER), journals, frames }
    }

    /// The present scene.
    pub(crate) fn scene(&self) -> Arc<Scene> {
        self.live.scene()
    }

    /// The session, once it is open.
    pub(crate) fn session(&self) -> Option<Session> {
        self.live.session()
    }
}
