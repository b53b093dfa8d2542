//! What an order is about.

use std::fmt;

use vocabulary::{ComponentPath, Mention, ModuleName};

/// A component, or a module with all its components.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Subject {
    Component(ComponentPath),
    Module(ModuleName),
}

impl Subject {
    pub(super) fn module(&self) -> &ModuleName {
        match self {
            Subject::Component(path) => &path.module,
            Subject::Module(module) => module,
        }
    }

    pub(super) fn component(&self) -> Option<&ComponentPath> {
        match self {
            Subject::Component(path) => Some(path),
            Subject::Module(_) => None,
        }
    }

    /// As an order names it.
    pub(super) fn mention(&self) -> Option<Mention> {
        self.component().map(|path| path.component.clone().into())
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Subject::Component(path) => path.fmt(f),
            Subject::Module(module) => module.fmt(f),
        }
    }
}
