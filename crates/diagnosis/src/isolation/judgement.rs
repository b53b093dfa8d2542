//! What is found about one change once all is known.

use vocabulary::{ComponentPath, Step};

/// Root cause or effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Judgement {
    /// The change is the root: its component is faulty.
    Root,
    /// Nothing explains it: it is the root, if everybody was watching when something might have happened that does.
    First,
    /// It is no effect, because its component was a root cause before: whatever that came to.
    Again,
    /// Another component's change explains it.
    Explained {
        /// That component.
        by: ComponentPath,
        /// When it changed.
        since: Step,
    },
}
