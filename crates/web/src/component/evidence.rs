//! Journal and freeze frame of a component, as its module answers.

use observer::{LiveModule, ModuleHistory};
use wire::FaultTransition;

use crate::app::App;
use crate::desk::{Frame, Journal};

/// What was had of a component's module.
#[derive(Debug, Clone, Default)]
pub(crate) struct Evidence {
    /// Its module's journal, unless it was not asked yet.
    pub(super) journal: Option<Journal>,
    /// The freeze frame of its fault, or why there is none; nothing if it has no fault.
    pub(super) frame: Option<Frame>,
}

impl Evidence {
    /// Asks for it. A module that is not heard is not asked.
    pub(super) async fn fetch(
        app: &App,
        transition: &FaultTransition,
        module: Option<&LiveModule>,
    ) -> Self {
        let Some(module) = module else { return Self::default() };
        let heard = module.silent_since_unix_ns.is_none();
        let frame = async {
            match (transition.state.is_fault(), heard) {
                (false, _) => None,
                (true, false) => Some(Err("its module is not heard".into())),
                (true, true) => Some(app.desk.frames.of(app, transition).await),
            }
        };
        let (journal, frame) = tokio::join!(app.desk.journals.of(app, module), frame);
        Self { journal: Some(journal), frame }
    }

    pub(super) fn history(&self) -> Option<&ModuleHistory> {
        self.journal.as_ref()?.read.as_ref().ok().map(|history| &**history)
    }

    /// Whether it may be had in full after a while.
    pub(super) fn lacks(&self) -> bool {
        matches!(self.frame, Some(Err(_))) || self.history().is_none()
    }
}
