//! Isolation: which component is to blame for a change (section 4.3 of the paper, and beyond it).

mod first_change;
mod isolator;
mod knowledge;
mod paper;

pub(crate) use isolator::{Case, Finding, Isolator};

use first_change::Groups;
use knowledge::{KnownChange, PeerKnowledge};
use paper::judge as judge_by_the_paper;

use truss::ids::{ComponentPath, Step};

/// What is found about one change once all is known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Judgement {
    /// The change is the root: its component is faulty.
    Root,
    /// Another component's change explains it.
    Explained {
        /// That component.
        by: ComponentPath,
        /// When it changed.
        since: Step,
    },
}
