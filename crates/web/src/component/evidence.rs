//! Journals and the freeze frame of a component, fetched from the modules.

use std::sync::Arc;

use futures_util::future::join_all;
use observer::{ModuleHistory, ModuleView, Scene};
use vocabulary::{FaultTransition, ModuleName};

use crate::observed::{Frame, Observed};
use crate::records::ModuleTrends;

/// The answers of the modules.
#[derive(Debug, Clone, Default)]
pub(crate) struct ModuleAnswers {
    /// Journals of the structure's modules that were asked: a change may explain one in another module.
    pub(super) journals: Vec<Arc<ModuleHistory>>,
    /// The freeze frame of the present fault, or the reason why it is missing; `None` without a fault.
    pub(super) frame: Option<Frame>,
    /// How the margins of its module have developed; `None` if nothing is kept.
    pub(super) trends: Option<Arc<ModuleTrends>>,
}

impl ModuleAnswers {
    /// Fetches the answers. Modules that are not heard are not asked.
    pub(super) async fn fetch(
        observed: &Observed,
        scene: &Scene,
        transition: &FaultTransition,
    ) -> Self {
        let of = |module: &&ModuleView| module.structure.as_ref() == Some(&transition.structure);
        let modules = scene.modules.iter().filter(of);
        let journals = join_all(modules.map(|module| observed.journal(module)));
        let trends = observed.trends(&transition.structure, &transition.module);
        let frame = frame(observed, scene, transition);
        let (journals, frame, trends) = tokio::join!(journals, frame, trends);
        Self { journals: journals.into_iter().flatten().collect(), frame, trends }
    }

    /// The journal of this module.
    pub(super) fn journal(&self, module: &ModuleName) -> Option<&ModuleHistory> {
        self.journals.iter().find(|journal| journal.module == *module).map(Arc::as_ref)
    }

    /// All transitions in the journals, those of each module in order.
    pub(super) fn transitions(&self) -> impl Iterator<Item = &FaultTransition> {
        self.journals.iter().flat_map(|history| &history.transitions)
    }

    /// The modules whose journals could not be read.
    pub(super) fn unread(&self) -> impl Iterator<Item = &ModuleName> {
        let unread = self.journals.iter().filter(|journal| !journal.answered());
        unread.map(|journal| &journal.module)
    }

    /// Whether asking again later may yield more.
    pub(super) fn lacks(&self) -> bool {
        matches!(self.frame, Some(Err(_))) || self.unread().next().is_some()
    }
}

async fn frame(observed: &Observed, scene: &Scene, transition: &FaultTransition) -> Option<Frame> {
    let module = scene.module(Some(&transition.structure), &transition.module);
    if !transition.state().is_fault() {
        return None;
    }
    match module.map_or(Some("its diagnoser is not known"), ModuleView::why_unheard) {
        Some(why) => Some(Err(why.into())),
        None => Some(observed.frame(transition).await),
    }
}
