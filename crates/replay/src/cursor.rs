//! Decides which recorded sample a process used next.

use std::collections::BTreeSet;

use vocabulary::{RunId, Step};

use crate::samples::Samples;
use crate::shortfall::Shortfall;

/// The known position of the next sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NextSample {
    /// The next step of the same run.
    Following,
    /// This step of the same run.
    At(Step),
    /// The first step of a run, used at about this time \[ns since 1970\].
    Begins(RunId, Step, u64),
}

/// The position in a module's samples.
#[derive(Debug)]
pub(crate) struct SampleCursor<'a> {
    samples: &'a Samples,
    position: Option<(RunId, Step)>,
    /// Earlier samples belong to an earlier pass of the same run.
    not_before: Option<u64>,
    used: Vec<bool>,
    begun: BTreeSet<RunId>,
    near: usize,
}

impl<'a> SampleCursor<'a> {
    pub(crate) fn new(samples: &'a Samples) -> Self {
        Self {
            samples,
            position: None,
            not_before: None,
            used: vec![false; samples.len()],
            begun: BTreeSet::new(),
            near: 0,
        }
    }

    /// Continues after this sample, published at that time.
    pub(crate) fn resume(&mut self, (run, step): (RunId, Step), not_before: Option<u64>) {
        self.position = Some((run, step));
        self.not_before = not_before;
        self.begun.insert(run);
        self.near = self.samples.first_from(run, step.plus(1));
    }

    /// Run and step of the latest sample.
    pub(crate) fn position(&self) -> Option<(RunId, Step)> {
        self.position
    }

    /// The index of the next sample, after `taken` samples; `wanted` are known to have been used.
    pub(crate) fn advance(
        &mut self,
        next: NextSample,
        (taken, wanted): (u64, u64),
    ) -> Result<usize, Shortfall> {
        let unknown = || Shortfall::UnknownSample { samples: taken };
        let (run, step) = match (next, self.position) {
            (NextSample::Begins(run, step, _), _) => (run, step),
            (NextSample::At(step), Some((run, _))) => (run, step),
            (NextSample::Following, Some((run, last))) => (run, last.plus(1)),
            (NextSample::At(_) | NextSample::Following, None) => return Err(unknown()),
        };
        let group = self.samples.of(run, step, self.near);
        let chosen = match next {
            NextSample::Begins(_, _, at) => self.nearest(group, at),
            NextSample::At(_) | NextSample::Following => self.first(group),
        };
        let Some(index) = chosen else { return Err(self.missing(run, step, wanted - taken)) };
        if let NextSample::Begins(..) = next {
            let is_again = !self.begun.insert(run) || self.samples.of(run, step, index).len() > 1;
            let time = self.samples.head(index).map(|head| head.time_unix_ns);
            self.not_before = time.filter(|_| is_again);
        }
        self.used[index] = true;
        self.near = index + 1;
        self.position = Some((run, step));
        Ok(index)
    }

    fn nearest(&self, group: std::ops::Range<usize>, at: u64) -> Option<usize> {
        let distance = |index: &usize| self.time(*index).abs_diff(at);
        group.filter(|index| !self.used[*index]).min_by_key(distance)
    }

    fn first(&self, group: std::ops::Range<usize>) -> Option<usize> {
        let not_before = self.not_before.unwrap_or_default();
        group.filter(|index| !self.used[*index]).find(|index| self.time(*index) >= not_before)
    }

    fn time(&self, index: usize) -> u64 {
        self.samples.head(index).map_or(0, |head| head.time_unix_ns)
    }

    /// The missing steps from this one up to the next recorded one.
    fn missing(&self, run: RunId, from: Step, count: u64) -> Shortfall {
        let furthest = from.plus(count.saturating_sub(1));
        let next = self.samples.head(self.samples.first_from(run, from.plus(1)));
        let to = match next {
            Some(head) if head.run == run => furthest.min(head.step.minus(1)),
            _ => furthest,
        };
        Shortfall::SamplesMissing { run, from, to }
    }
}
