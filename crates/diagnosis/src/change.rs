//! Changes: a channel's divergence rose above its threshold.

use vocabulary::{Change, Component, Step};

/// Longest window within which changes count as simultaneous, in steps.
pub const MAX_TIE: usize = 31;

/// A change of the module's own, remembered with the growth of its ratio.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct LoggedChange {
    /// Number of the channel.
    pub(crate) channel: usize,
    /// Since when the residual may have been changing.
    pub(crate) onset: Step,
    /// The step of the change.
    pub(crate) step: Step,
    /// Largest D/γ up to `i` steps after the change, i = 0, 1, …
    peaks: Vec<f64>,
    /// The last step at which D was at γ or above.
    last: Step,
    /// Its end was known before a restart.
    pub(crate) over: bool,
}

impl LoggedChange {
    pub(crate) fn new(channel: usize, onset: Step, step: Step, ratio: f64) -> Self {
        Self { channel, onset, step, peaks: vec![ratio], last: step, over: false }
    }

    /// One that is known from before a restart.
    pub(crate) fn recalled(channel: usize, change: &Change, watched_until: Step) -> Self {
        let last = change.until.unwrap_or(watched_until.max(change.step));
        let over = change.until.is_some();
        Self { last, over, ..Self::new(channel, change.onset, change.step, change.ratio) }
    }

    /// The channel is still changing at this step.
    pub(crate) fn prolong(&mut self, step: Step) {
        self.last = self.last.max(step);
    }

    /// Had the change ended by `step`? Then at which step?
    pub(crate) fn ended_as_of(&self, step: Step, quiet_steps: u64) -> Option<Step> {
        (self.last.plus(quiet_steps) <= step).then_some(self.last)
    }

    /// Takes the ratio at a later step into account, while the tie window lasts.
    pub(crate) fn follow(&mut self, step: Step, ratio: f64, tie: usize) {
        let place = usize::try_from(step.since(self.step)).unwrap_or(usize::MAX).min(tie);
        while self.peaks.len() <= place {
            self.peaks.push(self.peaks.last().copied().unwrap_or(0.0));
        }
        if step.since(self.step) <= tie as u64
            && let Some(peak) = self.peaks.get_mut(place)
        {
            *peak = peak.max(ratio);
        }
    }

    /// Raises the ratio throughout.
    pub(crate) fn raise(&mut self, ratio: f64) {
        self.peaks.iter_mut().for_each(|peak| *peak = peak.max(ratio));
    }

    /// As it is reported, as it stood at `step`: with the end known then.
    pub(crate) fn as_of(
        &self,
        step: Step,
        until: Option<Step>,
        components: &[Component],
    ) -> Change {
        Change {
            component: components[self.channel].clone(),
            onset: self.onset,
            step: self.step,
            ratio: self.ratio_as_of(step),
            until,
        }
    }

    /// The ratio as it stood at `step`.
    pub(crate) fn ratio_as_of(&self, step: Step) -> f64 {
        let place = usize::try_from(step.since(self.step)).unwrap_or(usize::MAX);
        let last = self.peaks.len() - 1;
        // Not empty: `new` puts the first ratio in and nothing is ever taken out.
        self.peaks[place.min(last)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_is_reported_as_it_stood_at_the_step_asked_for() {
        let mut change = LoggedChange::new(0, Step(9), Step(10), 1.5);
        change.follow(Step(11), 4.0, 3);
        change.follow(Step(13), 2.0, 3);
        change.follow(Step(14), 9.0, 3);
        let ratios: Vec<f64> = (10..20).map(|k| change.ratio_as_of(Step(k))).collect();
        assert_eq!(ratios, [1.5, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0]);
    }
}
