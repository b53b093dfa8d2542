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
use crate::records::{ModuleTrends, PageRecords};
use answers::Answers;

pub(crate) use traces::Traces;

/// How long answers are reused: a journal grows, and a frame may be recorded a moment later.
const KEEP_JOURNAL: Duration = Duration::from_secs(2);
const KEEP_FRAME: Duration = Duration::from_secs(3);
/// Trends are read from the disk no more often than the shortest interval ends.
const KEEP_TRENDS: Duration = Duration::from_secs(20);
/// Most transitions shown of a module; `trusswatch history` shows all.
const LATEST: u64 = 2000;
/// Most recorded events shown of a module.
const KEPT: usize = 2000;

/// A drawing of a freeze frame, or the reason why it is missing.
pub(crate) type Frame = Result<Arc<str>, Arc<str>>;

/// The observed structures.
#[derive(Debug)]
pub(crate) struct Observed {
    pub(crate) live: Live,
    /// Timeout for answers of modules.
    pub(crate) timeout: Duration,
    /// The page's own records.
    pub(crate) records: Arc<PageRecords>,
    /// The divergences of each module whose pages are viewed.
    traces: Hub<(StructureName, ModuleName), Arc<Traces>>,
    journals: Answers<(StructureName, ModuleName), Arc<ModuleHistory>>,
    frames: Answers<String, Frame>,
    trends: Answers<(StructureName, ModuleName), Arc<ModuleTrends>>,
}

impl Observed {
    pub(crate) fn new(live: Live, records: PageRecords, timeout: Duration) -> Self {
        let (journals, frames) = (Answers::new(KEEP_JOURNAL), Answers::new(KEEP_FRAME));
        let trends = Answers::new(KEEP_TRENDS);
        let (records, traces) = (Arc::new(records), Hub::new(LINGER));
        Self { live, timeout, records, traces, journals, frames, trends }
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
        let heard = || async {
            let (records, of) =
                (Arc::clone(&self.records), (structure.clone(), module.module.clone()));
            let heard = move || records.history(&of.0, &of.1, 0..=u64::MAX, KEPT);
            let none = ModuleHistory::new(structure, &module.module, since);
            tokio::task::spawn_blocking(heard).await.unwrap_or(none)
        };
        let none = async |why: &str| {
            let broken_off = Some(QueryError::NotAsked(why.to_owned()));
            let heard = heard().await;
            let none = ModuleHistory::new(structure, &module.module, since);
            let is_empty = heard.transitions.is_empty() && heard.phases.is_empty();
            let known = if is_empty { none } else { heard };
            Some(Arc::new(ModuleHistory { broken_off, ..known }))
        };
        if let Some(why) = module.why_unheard() {
            return none(why).await;
        }
        let Some(session) = self.session() else {
            return none("the network is not connected").await;
        };
        let history =
            || session::client::history(&session, structure, &module.module, since, self.timeout);
        let fetch = || async {
            let observed = heard().await.observed;
            Arc::new(ModuleHistory { observed, ..history().await })
        };
        Some(self.journals.get((structure.clone(), module.module.clone()), fetch).await)
    }

    /// How the margins of a module have developed; `None` if nothing is kept.
    pub(crate) async fn trends(
        &self,
        structure: &StructureName,
        module: &ModuleName,
    ) -> Option<Arc<ModuleTrends>> {
        if !self.records.is_there() {
            return None;
        }
        let key = (structure.clone(), module.clone());
        let (records, of) = (Arc::clone(&self.records), key.clone());
        let read = move || ModuleTrends::read(&records, (&of.0, &of.1));
        let fetch =
            || async { Arc::new(tokio::task::spawn_blocking(read).await.unwrap_or_default()) };
        Some(self.trends.get(key, fetch).await)
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
