//! How a transition stands to the latest one of its module that was handed out.

use vocabulary::FaultTransition;

/// What is remembered of a transition that was handed out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Mark {
    /// What its sequence number counts in.
    pub(super) incarnation: u64,
    /// Its sequence number.
    pub(super) sequence: u64,
    /// When it was published \[ns since 1970\].
    pub(super) time_unix_ns: u64,
}

/// Where a transition belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// It comes after the latest one.
    After,
    /// It is the latest one or comes before it: it was handed out, or is older than the feed.
    Before,
    /// The module counts from the beginning again: its state directory was wiped, or it keeps none.
    NewBeginning,
}

impl Mark {
    pub(super) fn of(transition: &FaultTransition) -> Self {
        let FaultTransition { incarnation, sequence, time_unix_ns, .. } = transition;
        let (sequence, time_unix_ns) = (*sequence, *time_unix_ns);
        Self { incarnation: *incarnation, sequence, time_unix_ns }
    }
}

/// Where a transition belongs. A later incarnation is a new beginning. In the same one, a number
/// that was given before, at a later time, is one of a new beginning; at the same time, it is the same again.
pub(super) fn place(latest: Mark, transition: &FaultTransition) -> Place {
    if latest.incarnation != transition.incarnation {
        let is_later = transition.incarnation > latest.incarnation;
        return if is_later { Place::NewBeginning } else { Place::Before };
    }
    if transition.sequence > latest.sequence {
        Place::After
    } else if transition.time_unix_ns > latest.time_unix_ns {
        Place::NewBeginning
    } else {
        Place::Before
    }
}
