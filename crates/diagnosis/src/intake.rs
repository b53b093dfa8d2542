//! Which samples are taken: their lengths, the run they belong to, the order of their steps.

use std::cmp::Ordering;

use vocabulary::{RunId, Step};

use crate::channels::ChannelLayout;
use crate::sample::{Measurements, SampleRejection};
use crate::settings::Sampling;

/// How far a single sample may lie ahead of the one before it \[s\].
const LONGEST_STEP_JUMP_S: f64 = 10.0;

/// Samples whose steps follow one another for so long \[s\], all of them passed already, come from a publisher that
/// has begun again with the same run: what comes late comes a few at a time.
const BEGUN_AGAIN_S: f64 = 0.05;

/// How a sample that is taken follows the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Admission {
    /// The first of a run.
    First {
        /// The last step of the run before, if there was one.
        ended: Option<Step>,
    },
    /// It follows `last` after so many missing steps.
    Following {
        /// The step of the sample before.
        last: Step,
        /// Steps between the two.
        missing: u64,
    },
}

/// The position in the stream of samples.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Intake {
    layout: ChannelLayout,
    sampling: Sampling,
    /// Run and step of the latest sample taken.
    position: Option<(RunId, Step)>,
    /// The run that was being diagnosed before a restart, until the first sample comes.
    recalled_run: Option<RunId>,
    /// The step of a sample that jumped too far ahead to be accepted alone.
    step_jump: Option<Step>,
    /// The latest of the samples whose steps were passed, and how many have followed one another.
    late: Option<(Step, u64)>,
}

impl Intake {
    /// Takes samples of a module with these channels.
    pub(crate) fn new(layout: ChannelLayout, sampling: Sampling) -> Self {
        let (position, recalled_run) = (None, None);
        Self { layout, sampling, position, recalled_run, step_jump: None, late: None }
    }

    /// The run that was being diagnosed before a restart.
    pub(crate) fn recall(&mut self, run: RunId) {
        self.recalled_run = Some(run);
    }

    pub(crate) fn recalled_run(&self) -> Option<RunId> {
        self.recalled_run
    }

    pub(crate) fn position(&self) -> Option<(RunId, Step)> {
        self.position
    }

    pub(crate) fn run(&self) -> Option<RunId> {
        self.position.map(|(run, _)| run)
    }

    pub(crate) fn last_step(&self) -> Option<Step> {
        self.position.map(|(_, step)| step)
    }

    /// Takes a sample.
    ///
    /// # Errors
    /// It cannot be used; the position is as before.
    pub(crate) fn admit(&mut self, sample: &Measurements) -> Result<Admission, SampleRejection> {
        sample.check(self.layout.actuators, self.layout.gages)?;
        let admission = match self.position {
            Some((run, last)) if run == sample.run => {
                if self.begins_again(last, sample.step) {
                    self.step_jump = None;
                    Admission::First { ended: Some(last) }
                } else {
                    self.follow(last, sample.step)?
                }
            }
            other => self.begin(sample.run, other),
        };
        self.late = None;
        self.position = Some((sample.run, sample.step));
        Ok(admission)
    }

    fn begin(&mut self, run: RunId, before: Option<(RunId, Step)>) -> Admission {
        let recalled = self.recalled_run.take().map(|run| (run, Step::default()));
        let ended = before.or(recalled).filter(|(previous, _)| *previous != run);
        self.step_jump = None;
        Admission::First { ended: ended.map(|(_, last)| last) }
    }

    /// Has the publisher begun again, so that steps go back?
    fn begins_again(&mut self, last: Step, step: Step) -> bool {
        if step >= last {
            return false;
        }
        let follows = |(before, _): &(Step, u64)| before.plus(1) == step;
        let count = self.late.filter(follows).map_or(0, |(_, count)| count) + 1;
        self.late = Some((step, count));
        count >= self.sampling.steps(BEGUN_AGAIN_S)
    }

    fn follow(&mut self, last: Step, step: Step) -> Result<Admission, SampleRejection> {
        match step.cmp(&last) {
            Ordering::Less => return Err(SampleRejection::Late),
            Ordering::Equal => return Err(SampleRejection::Repeated),
            Ordering::Greater => {}
        }
        self.check_step_jump(last, step)?;
        Ok(Admission::Following { last, missing: step.since(last) - 1 })
    }

    /// A step jump is accepted once a second sample follows where the first one landed.
    fn check_step_jump(&mut self, last: Step, step: Step) -> Result<(), SampleRejection> {
        let landed = self.step_jump.replace(step);
        let follows = landed.map(|landed| landed.plus(1)) == Some(step);
        if step.since(last) > self.sampling.steps(LONGEST_STEP_JUMP_S) && !follows {
            return Err(SampleRejection::FarAhead);
        }
        self.step_jump = None;
        Ok(())
    }
}
