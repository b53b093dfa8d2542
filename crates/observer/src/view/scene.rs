//! The observed structures at one moment.

use std::collections::VecDeque;
use std::sync::Arc;

use vocabulary::{ComponentPath, FaultTransition, ModuleName, StructureName};

use super::component::Counts;
use super::id::{ComponentId, ModuleId};
use super::module::ModuleView;
use super::news::ObservedEvent;

/// The state of the network connection.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum NetworkState {
    /// A session is being opened.
    #[default]
    Opening,
    /// The session is open and connected to at least one process. Whether modules answer over it is up to their views.
    Open,
    /// The session is open, but none of its endpoints answers since then, by the local clock \[ns since 1970\]. Nothing is
    /// known of any module; Zenoh keeps trying to connect.
    CutOff(u64),
    /// Opening a session failed for this reason; it is retried.
    Failed(String),
    /// The session has ended.
    Closed,
}

/// The observed structures at one moment. Anything in doubt is shown as unknown, never as normal.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Grows with every change.
    pub number: u64,
    /// When it was made, by the local clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The network connection.
    pub network: NetworkState,
    /// Whether a query for the states of components is pending.
    pub is_asking: bool,
    /// The modules, by structure and name.
    pub modules: Vec<ModuleView>,
    /// The latest events, oldest first.
    pub events: VecDeque<Arc<ObservedEvent>>,
    /// Refusals and messages that could not be read, the latest last.
    pub problems: VecDeque<String>,
}

impl Scene {
    /// The components of all modules.
    pub fn components(&self) -> impl Iterator<Item = &FaultTransition> {
        self.modules.iter().flat_map(|module| &module.components)
    }

    /// A component of a structure; of any structure if none is named.
    #[must_use]
    pub fn component(
        &self,
        structure: Option<&StructureName>,
        path: &ComponentPath,
    ) -> Option<&FaultTransition> {
        self.components().find(|known| {
            known.component == *path && structure.is_none_or(|name| known.structure == *name)
        })
    }

    /// The present state of this component.
    #[must_use]
    pub fn state_of(&self, id: &ComponentId) -> Option<&FaultTransition> {
        self.component(Some(&id.structure), &id.component)
    }

    /// This module.
    #[must_use]
    pub fn view_of(&self, id: &ModuleId) -> Option<&ModuleView> {
        self.module(id.structure.as_ref(), &id.module)
    }

    /// A module of a structure; of any structure if none is named.
    #[must_use]
    pub fn module(
        &self,
        structure: Option<&StructureName>,
        module: &ModuleName,
    ) -> Option<&ModuleView> {
        let is_meant = |known: &&ModuleView| {
            known.module == *module
                && structure.is_none_or(|name| known.structure.as_ref() == Some(name))
        };
        self.modules.iter().find(is_meant)
    }

    /// The modules of each structure. Modules that are only expected belong to no structure yet.
    pub fn structures(&self) -> impl Iterator<Item = &[ModuleView]> {
        self.modules.chunk_by(|a, b| a.structure == b.structure)
    }

    /// Whether any module has sent a message.
    #[must_use]
    pub fn has_heard_a_module(&self) -> bool {
        let is_heard = |module: &ModuleView| module.present || module.heard_unix_ns > 0;
        self.modules.iter().any(is_heard)
    }

    /// A summary in one sentence; never a statement that all is well.
    #[must_use]
    pub fn summary(&self) -> String {
        if self.modules.is_empty() {
            let is_open = self.network == NetworkState::Open;
            let words = if is_open { "no module answers" } else { "no network: state unknown" };
            return words.to_owned();
        }
        let words = in_a_sentence(&self.modules);
        match self.network {
            NetworkState::Open => words,
            NetworkState::CutOff(_) => format!("cut off from the network; {words}"),
            NetworkState::Opening => format!("not connected yet; {words}"),
            _ => format!("{words}; last known state"),
        }
    }
}

/// Most names of modules in a sentence.
const NAMES: usize = 3;

/// Modules and their components in one sentence, which also says whose components are not counted.
#[must_use]
pub fn in_a_sentence(modules: &[ModuleView]) -> String {
    let is_missing = |module: &&ModuleView| !module.is_in_service() && !module.is_cut_off;
    let missing = modules.iter().filter(is_missing).count();
    let mut parts = Vec::new();
    if missing > 0 {
        parts.push(format!("{missing} of {} modules not in service", modules.len()));
    }
    let counts = Counts::of(modules.iter().flat_map(|module| &module.components));
    parts.push(counts.words());
    let uncounted = modules.iter().filter(|module| module.components.is_empty());
    let uncounted: Vec<&str> = uncounted.map(|module| module.module.as_str()).collect();
    match uncounted.len() {
        0 => {}
        _ if counts.total() == 0 => {}
        1..=NAMES => parts.push(format!("those of {} unknown", uncounted.join(", "))),
        many => parts.push(format!("those of {many} modules unknown")),
    }
    parts.join("; ")
}
