//! The plant's progress, from the samples that it publishes; independent of the diagnosers.

use vocabulary::{RunId, Sample, Step};

use crate::in_time;
use crate::noted::Noted;
use crate::observer::Observer;

type Latest = Option<(RunId, Step)>;

/// The latest run and step of the plant.
pub struct PlantClock(Noted<Latest>);

impl PlantClock {
    /// Listens from now on.
    pub async fn of(observer: &Observer) -> Self {
        Self::of_module(observer, "module2").await
    }

    /// Listens to the samples of this module from now on.
    pub async fn of_module(observer: &Observer, module: &str) -> Self {
        let keys = [format!("trusswatch/{}/{module}/sample", observer.structure)];
        let note = |latest: &mut Latest, sample: Sample| *latest = Some((sample.run, sample.step));
        Self(Noted::of(&observer.session, &keys, None, note).await)
    }

    /// Waits until the plant is at a step of a run, or beyond.
    pub async fn reach(&self, run: RunId, step: u64) {
        let reached = |latest: &Latest| {
            let there = latest.is_some_and(|(present, at)| present == run && at >= Step(step));
            there.then_some(())
        };
        in_time(&format!("step {step} of run {run}"), self.0.first(reached)).await;
    }

    /// The latest step of a run; `None` before its first.
    pub fn step(&self, run: RunId) -> Option<Step> {
        self.0.so_far().and_then(|(present, step)| (present == run).then_some(step))
    }
}
