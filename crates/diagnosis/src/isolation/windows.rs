//! How long changes bear on each other: ties, effects, what leaves the interval.

use vocabulary::Step;

use super::knowledge::{ChangePeriod, KnownChange};
use crate::divergence::DivergenceSettings;
use crate::settings::IsolationSettings;

/// Steps and ratios by which changes are judged.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(super) struct Windows {
    /// Steps within which changes are simultaneous.
    pub(super) tie: u64,
    /// Steps that effects take to show, and to end.
    pub(super) effects: u64,
    /// Steps that a jump takes to pass through the window.
    pub(super) spread: u64,
    /// D/γ from which on a change is a root cause by its ratio.
    pub(super) root_ratio: f64,
    /// Steps after which what entered the interval leaves it: from, to. `None` if it never does.
    pub(super) leaving: Option<(u64, u64)>,
}

impl Windows {
    /// As a module's settings make them.
    pub(super) fn new(isolation: &IsolationSettings, divergence: &DivergenceSettings) -> Self {
        let IsolationSettings { effect_steps: effects, tie_steps: tie, root_ratio, .. } =
            *isolation;
        let spread = (divergence.window + divergence.lag) as u64;
        let leaving = divergence.interval.vectors().map(|vectors| {
            let interval = vectors as u64;
            (interval.saturating_sub(effects), interval + spread + effects)
        });
        Self { tie, effects, spread, root_ratio, leaving }
    }

    /// Those of `changes` that are simultaneous with `first`, the first of them.
    pub(super) fn simultaneous<'a>(
        &self,
        changes: &'a [KnownChange],
        first: &KnownChange,
    ) -> &'a [KnownChange] {
        let tie = first.step.plus(self.tie);
        &changes[..changes.partition_point(|change| change.step <= tie)]
    }

    /// Did it jump? What may have begun in a gap may as well have grown.
    pub(super) fn is_root_by_ratio(&self, change: &KnownChange) -> bool {
        change.ratio >= self.root_ratio && change.step.since(change.onset) <= self.spread
    }

    /// The last step at which a root cause explains anything that has changed until then; `None` while it
    /// changes.
    pub(super) fn explains_until(&self, until: Option<Step>) -> Option<Step> {
        until.map(|until| until.plus(self.effects))
    }

    /// The last step at which a change that has gone on until then bears on anything; `None` while it goes on.
    pub(super) fn forgets(&self, until: Option<Step>) -> Option<Step> {
        until.map(|until| until.plus(self.leaving.map_or(self.effects, |(_, to)| to)))
    }

    /// When what entered the interval leaves it: from, until.
    pub(super) fn leaving(&self, entered: ChangePeriod) -> Option<(Step, Option<Step>)> {
        let (from, to) = self.leaving?;
        Some((entered.since.plus(from), entered.until.map(|until| until.plus(to))))
    }

    /// Does what entered the interval leave it at this step?
    pub(super) fn leaves(&self, entered: ChangePeriod, step: Step) -> bool {
        let leaves = self.leaving(entered);
        leaves.is_some_and(|(from, to)| from <= step && to.is_none_or(|to| step <= to))
    }
}
