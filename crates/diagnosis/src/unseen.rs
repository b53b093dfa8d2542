//! A stretch of steps that no divergence covers. What began there shows after it, as if it began then.

use vocabulary::Step;

/// The latest such stretch, for as long as what began there may still show.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(crate) struct Unseen {
    /// Steps that a change takes to show at most, once divergences are defined again.
    delay: u64,
    since: Option<Step>,
    /// Divergences are defined again from this step on.
    over: Option<Step>,
}

impl Unseen {
    pub(crate) fn new(delay: u64) -> Self {
        Self { delay, since: None, over: None }
    }

    /// Nothing that began before shows any more.
    pub(crate) fn forget(&mut self) {
        *self = Self::new(self.delay);
    }

    /// From this step on nothing is seen.
    pub(crate) fn begin(&mut self, step: Step) {
        self.since.get_or_insert(step);
        self.over = None;
    }

    /// Takes whether divergences are defined at a step.
    pub(crate) fn observe(&mut self, step: Step, defined: bool) {
        if self.since.is_none() || !defined {
            return;
        }
        let over = *self.over.get_or_insert(step);
        if step.since(over) > self.delay {
            self.forget();
        }
    }

    /// When a change may have begun that seems to have begun at `onset`.
    pub(crate) fn earliest(&self, onset: Step) -> Step {
        self.since.map_or(onset, |since| since.min(onset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_shows_soon_after_a_gap_may_have_begun_in_it() {
        let mut unseen = Unseen::new(3);
        assert_eq!(unseen.earliest(Step(5)), Step(5));
        unseen.begin(Step(10));
        for step in 20..30 {
            unseen.observe(Step(step), false);
            assert_eq!(unseen.earliest(Step(step)), Step(10));
        }
        let earliest = |step: u64| {
            unseen.observe(Step(step), true);
            unseen.earliest(Step(step)).0
        };
        let found: Vec<u64> = (30..36).map(earliest).collect();
        assert_eq!(found, [10, 10, 10, 10, 34, 35]);
    }
}
