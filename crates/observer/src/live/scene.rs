//! What a view shows.

use std::collections::VecDeque;
use std::sync::Arc;

use names::{ComponentPath, StructureName};
use wire::FaultTransition;

use crate::feed::News;
use crate::picture::ModulePicture;

/// Whether there is a network.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum NetworkState {
    /// A session is being opened.
    #[default]
    Opening,
    /// There is a session. Whether anybody is heard over it, the modules show.
    Open,
    /// No session could be opened, for this reason; it is tried again.
    Failed(String),
    /// The session has ended.
    Closed,
}

/// A module in a scene. Nothing in it is called normal that is not known to be.
#[derive(Debug, Clone, PartialEq)]
pub struct LiveModule {
    /// The module with its components. What was normal is unknown while the module is silent, stale or not in service.
    pub picture: ModulePicture,
    /// When it was last heard \[ns since 1970\], if it is not heard any more; 0 if it never was.
    pub silent_since_unix_ns: Option<u64>,
}

/// Something that happened, with a number that counts the events of this scene from 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Its number.
    pub number: u64,
    /// When it came, by the clock here \[ns since 1970\].
    pub time_unix_ns: u64,
    /// What.
    pub news: News,
}

/// What is known at one moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Grows with every change.
    pub number: u64,
    /// When it was made, by the clock here \[ns since 1970\].
    pub time_unix_ns: u64,
    /// Whether there is a network.
    pub network: NetworkState,
    /// The modules, by structure and name.
    pub modules: Vec<LiveModule>,
    /// The latest events, oldest first.
    pub events: VecDeque<Arc<Event>>,
    /// Messages that could not be read, the latest last.
    pub problems: VecDeque<String>,
}

impl Scene {
    /// The components of all modules.
    pub fn components(&self) -> impl Iterator<Item = &FaultTransition> {
        self.modules.iter().flat_map(|module| &module.picture.components)
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
}
