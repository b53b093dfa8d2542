//! Sampling instants and runs.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A sampling instant, counted from 0 within one run.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
#[derive(schemars::JsonSchema)]
pub struct Step(pub u64);

impl Step {
    /// The step `count` later; stays at the largest step instead of overflowing.
    #[must_use]
    pub fn plus(self, count: u64) -> Step {
        Step(self.0.saturating_add(count))
    }

    /// The step `count` earlier, at least 0.
    #[must_use]
    pub fn minus(self, count: u64) -> Step {
        Step(self.0.saturating_sub(count))
    }

    /// Steps from `earlier` to here, 0 if `earlier` is later.
    #[must_use]
    pub fn since(self, earlier: Step) -> u64 {
        self.0.saturating_sub(earlier.0)
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// Tells one run of the plant (or of the data acquisition) from the next; steps restart with it.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
#[derive(schemars::JsonSchema)]
pub struct RunId(pub u64);

impl fmt::Display for RunId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_do_not_overflow() {
        assert_eq!(Step(u64::MAX).plus(5), Step(u64::MAX));
        assert_eq!(Step(3).minus(5), Step(0));
        assert_eq!(Step(3).since(Step(5)), 0);
    }
}
