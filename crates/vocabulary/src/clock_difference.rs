//! Whether a module's clock and that of the publisher of its samples agree.

use std::fmt;

use crate::phase::ModulePhase;
use crate::status::ModuleStatus;

/// No sample is diagnosed before it is published \[s\].
const BEHIND_S: f64 = 1.0;
/// A module drops its backlog before it is this old, so no sample is diagnosed so late \[s\].
const AHEAD_S: f64 = 60.0;

/// By how much a module's clock is ahead of the publisher's \[s\]; negative if it is behind. Displayed as a
/// sentence about the module.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockDifference {
    /// The difference, apart from the true lag \[s\].
    pub ahead_s: f64,
}

impl ModuleStatus {
    /// How far the clocks are apart, if the lag can have no other reason.
    #[must_use]
    pub fn clock_difference(&self) -> Option<ClockDifference> {
        let ahead_s = self.lag_ms? / 1e3;
        let arrives = self.phase != ModulePhase::Stale;
        (ahead_s < -BEHIND_S || (ahead_s > AHEAD_S && arrives))
            .then_some(ClockDifference { ahead_s })
    }
}

impl fmt::Display for ClockDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let apart_s = self.ahead_s.abs();
        let digits = usize::from(apart_s < 10.0);
        let side = if self.ahead_s < 0.0 { "behind" } else { "ahead of" };
        write!(
            f,
            "its clock is {apart_s:.digits$} s {side} the publisher's; check time synchronisation"
        )
    }
}
