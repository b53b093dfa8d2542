//! The situation of a case.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The situation of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Situation {
    /// No fault.
    Healthy,
    /// The fault is present from the first step on.
    FromTheStart,
    /// The fault begins while samples are lost.
    InAGap,
    /// The fault begins while its diagnoser is down for longer than the publisher stores samples.
    WhileDown,
    /// A gage drifts slowly.
    Drift,
    /// The fault begins within five seconds of another one.
    Second,
    /// A gage fails while a cylinder is hard over.
    DuringHardOver,
    /// For identification: a single fault.
    Alone,
    /// For identification: a cylinder was leaking or hard over for up to a second before, and gages show the effects.
    AfterEffects,
    /// A history: one fault that is repaired soon.
    Repaired,
    /// A history: one fault that comes and goes.
    Intermittent,
    /// A history: a second fault after a first that stays.
    Overlapping,
    /// A history: several faults, each repaired, some recurring.
    Several,
}

impl Situation {
    /// Situations that hide a fault from the change detector, and the one without a fault.
    pub const HIDDEN: [Self; 7] = [
        Self::Healthy,
        Self::FromTheStart,
        Self::InAGap,
        Self::WhileDown,
        Self::Drift,
        Self::Second,
        Self::DuringHardOver,
    ];

    /// Situations before a fault that is to be identified.
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

    /// Whether it is one of [`Self::HISTORIES`].
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
