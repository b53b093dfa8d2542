//! Journals and the freeze frame of a component, as the modules answer.

use futures_util::future::join_all;
use names::ModuleName;
use observer::{LiveModule, Scene};
use wire::FaultTransition;

use crate::app::App;
use crate::desk::{Frame, Journal};
use crate::view::find_module;

/// What was had of the modules.
#[derive(Debug, Clone, Default)]
pub(crate) struct Evidence {
    /// The journals of its structure's modules, as far as they were asked: a change may explain one of another module.
    pub(super) journals: Vec<Journal>,
    /// The freeze frame of its fault, or why there is none; nothing if it has no fault.
    pub(super) frame: Option<Frame>,
}

impl Evidence {
    /// Asks for it. A module that is not heard is not asked.
    pub(super) async fn fetch(app: &App, scene: &Scene, transition: &FaultTransition) -> Self {
        let of = |module: &&LiveModule| {
            module.picture.member.structure.as_ref() == Some(&transition.structure)
        };
        let modules = scene.modules.iter().filter(of);
        let journals = join_all(modules.map(|module| app.desk.journals.of(app, module)));
        let (journals, frame) = tokio::join!(journals, frame(app, scene, transition));
        Self { journals, frame }
    }

    /// The journal of this module.
    pub(super) fn journal(&self, module: &ModuleName) -> Option<&Journal> {
        self.journals.iter().find(|journal| journal.module == *module)
    }

    /// The transitions that the journals hold, those of a module in their order.
    pub(super) fn transitions(&self) -> impl Iterator<Item = &FaultTransition> {
        let read = self.journals.iter().filter_map(|journal| journal.read.as_ref().ok());
        read.flat_map(|history| &history.transitions)
    }

    /// Whether it may be had in full after a while.
    pub(super) fn lacks(&self) -> bool {
        matches!(self.frame, Some(Err(_)))
            || self.journals.iter().any(|journal| journal.read.is_err())
    }
}

async fn frame(app: &App, scene: &Scene, transition: &FaultTransition) -> Option<Frame> {
    let module = find_module(scene, Some(&transition.structure), &transition.module);
    match (transition.state().is_fault(), module.is_some_and(|m| m.silent_since_unix_ns.is_none()))
    {
        (false, _) => None,
        (true, false) => Some(Err("its module is not heard".into())),
        (true, true) => Some(app.desk.frames.of(app, transition).await),
    }
}
