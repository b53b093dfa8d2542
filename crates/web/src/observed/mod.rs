//! The observed structures: the scene, and answers of modules, fetched once for all pages. A hundred open pages load a
//! module no more than one.
//!
//! | file | what |
//! |---|---|
//! | `answers` | answers of modules, kept for a moment |
//! | `traces` | a module's divergences of the last minute |

mod answers;
mod traces;

use std::sync::Arc;
use std::time::Duration;

use observer::{ModuleHistory, ModuleView, QueryError, Scene};
use session::client::Live;
use vocabulary::{FaultTransition, ModuleName, StructureName};
use zenoh::Session;

use crate::hub::{Hub, LINGER};
use answers::Answers;

pub(crate) use traces::Traces;

/// How long answers are reused: a journal grows, and a frame may be recorded a moment later.
const KEEP_JOURNAL: Duration = Duration::from_secs(2);
const KEEP_FRAME: Duration = Duration::from_secs(3);
/// Most transitions shown of a module; `trusswatch history` shows all.
const LATEST: u64 = 2000;

/// A drawing of a freeze frame, or the reason why it is missing.
pub(crate) type Frame = Result<Arc<str>, Arc<str>>;

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

    /// The latest entries of a module's journal; `None` for a module that is only expected and whose structure is not
    /// known. A module that is not heard is not asked.
    pub(crate) async fn journal(&self, module: &ModuleView) -> Option<Arc<ModuleHistory>> {
        let structure = module.structure.as_ref()?;
        let next = module.status.as_ref().map_or(1, |status| status.next_sequence);
        let since = next.saturating_sub(LATEST).max(1);
        let none = |why: &str| {
            let broken_off = Some(QueryError::NotAsked(why.to_owned()));
            let none = ModuleHistory::new(structure, &module.module, since);
            Some(Arc::new(ModuleHistory { broken_off, ..none }))
        };
        if let Some(why) = module.why_unheard() {
            return none(why);
        }
        let Some(session) = self.session() else { return none("the network is not connected") };
        let history =
            || session::client::history(&session, structure, &module.module, since, self.timeout);
        let fetch = || async { Arc::new(history().await) };
        Some(self.journals.get((structure.clone(), module.module.clone()), fetch).await)
    }

    /// The freeze frame of a component's present fault, as SVG text.
    pub(crate) async fn frame(&self, fault: &FaultTransition) -> Frame {
        let Some(session) = self.session() else {
            return Err("the network is not connected".into());
        };
        let key = format!("{}/{}/{}", fault.structure, fault.component, fault.sequence);
        let fetch = || async {
            let frame = session::client::freeze_frame_of(&session, fault, self.timeout).await;
            frame.map(|frame| figure::freeze_frame::svg(&frame).into()).map_err(Into::into)
        };
        self.frames.get(key, fetch).await
    }
}
