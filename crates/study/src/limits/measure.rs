//! Measuring: the same runs again and again, with faults of growing size.

use std::sync::atomic::AtomicBool;

use super::curve::{Detector, LimitCurve, LimitPoint, Reached, SizedKind};
use super::draw::Run;
use super::run::{Times, go_through};
use crate::conditions::{CommissionedPlant, ConditionCampaign};
use crate::error::StudyError;
use crate::parallel;

/// Plants in some weather, each commissioned in it.
#[derive(Debug, Clone)]
pub struct LimitStudy<'a> {
    /// The campaign that the plants are of.
    pub campaign: &'a ConditionCampaign,
    /// The plants; runs are shared among them.
    pub plants: &'a [CommissionedPlant],
    /// Runs of each size.
    pub runs: u64,
}

impl LimitStudy<'_> {
    /// Measures how fast a detector finds a kind of fault of these sizes, which ascend; `jobs` runs at a time. `done` is
    /// called after every run. `None` if it was stopped.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made, or no plant that can have such a fault.
    pub fn measure(
        &self,
        (detector, kind): (Detector, SizedKind),
        sizes: &[f64],
        jobs: usize,
        stop: &AtomicBool,
        mut done: impl FnMut() + Send,
    ) -> Result<Option<LimitCurve>, StudyError> {
        let items: Vec<(usize, u64)> =
            (0..sizes.len()).flat_map(|size| (0..self.runs).map(move |run| (size, run))).collect();
        let mut times: Vec<Vec<Times>> = vec![Vec::new(); sizes.len()];
        let work = |&(size, number): &(usize, u64)| {
            let plants = self.plants.len();
            let run = Run::draw(self.campaign, plants, (detector, kind), sizes[size], number)
                .ok_or(StudyError::NothingToBreak)?;
            go_through(self.plants, &run, detector)
        };
        let keep = |&(size, _): &(usize, u64), of_run: Times| {
            times[size].push(of_run);
            done();
            Ok(())
        };
        parallel::for_each(&items, jobs, stop, work, keep)?;
        if times.iter().map(Vec::len).sum::<usize>() < items.len() {
            return Ok(None);
        }
        let points = sizes.iter().zip(&times).map(|(size, times)| self.point(*size, times));
        Ok(Some(LimitCurve::of(detector, kind, points.collect())))
    }

    fn point(&self, size: f64, times: &[Times]) -> LimitPoint {
        let step_s = self.campaign.parameters.step_s;
        let reached =
            |of: fn(&Times) -> Option<u64>| Reached::of(times.iter().map(of).collect(), step_s);
        let (found, right) = (reached(|times| times.found), reached(|times| times.right));
        LimitPoint { size, runs: self.runs, found, right }
    }
}
