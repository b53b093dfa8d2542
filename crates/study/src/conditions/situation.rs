//! What is wrong in a case.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What is wrong in a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Situation {
    /// Nothing is wrong.
    Healthy,
    /// It is there from the first step on.
    FromTheStart,
    /// It begins while samples are lost.
    InAGap,
    /// It begins while its diagnoser is down for longer than samples are kept.
    WhileDown,
    /// A gage drifts slowly.
    Drift,
    /// It begins within five seconds of another one.
    Second,
    /// A gage fails while a cylinder is hard over.
    DuringHardOver,
    /// To be identified: nothing else happens.
    Alone,
    /// To be identified: a cylinder has leaked or been hard over for a second or less, and gages show its effects.
    AfterEffects,
    /// A history: one fault that is repaired soon.
    Repaired,
    /// A history: one fault that comes and goes.
    Intermittent,
    /// A history: a second fault after a first that stays.
    Overlapping,
    /// A history: several, each repaired and perhaps back again.
    Several,
}

impl Situation {
    /// Those that hide a fault from the change detector, and the one with none.
    pub const HIDDEN: [Self; 7] = [
        Self::Healthy,
        Self::FromTheStart,
        Self::InAGap,
        Self::WhileDown,
        Self::Drift,
        Self::Second,
        Self::DuringHardOver,
    ];

    /// What else happens before a fault that is to be identified.
    pub const IDENTIFIED: [Self; 4] =
        [Self::Alone, Self::AfterEffects, Self::DuringHardOver, Self::Second];

    /// Random histories.
    pub const HISTORIES: [Self; 4] =
        [Self::Repaired, Self::Intermittent, Self::Overlapping, Self::Several];

    /// Its name.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Healthy => "healthy",
            Self::FromTheStart => "from_the_start",
            Self::InAGap => "in_a_gap",
            Self::WhileDown => "while_down",
            Self::Drift => "drift",
            Self::Second => "second",
            Self::DuringHardOver => "during_hard_over",
            Self::Alone => "alone",
            Self::AfterEffects => "after_effects",
            Self::Repaired => "repaired",
            Self::Intermittent => "intermittent",
            Self::Overlapping => "overlapping",
            Self::Several => "several",
        }
    }

    /// Is it one of [`Self::HISTORIES`]?
    #[must_use]
    pub fn is_history(self) -> bool {
        Self::HISTORIES.contains(&self)
    }
}

impl fmt::Display for Situation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
