//! One run of a plant and its diagnosers: its random draw, and its course.

use vocabulary::Step;

use crate::error::StudyError;
use crate::group::{Diagnosed, RigEvent};
use crate::rig::{Rig, TimedFault};

/// Steps whose samples do not reach one diagnoser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleGap {
    /// The index of the diagnoser.
    pub place: usize,
    /// The first step that is missing.
    pub from: Step,
    /// The first step that arrives again.
    pub until: Step,
    /// Whether the diagnoser is restarted before that step, with its stored state and the samples that the publisher
    /// still has.
    pub restarted: bool,
}

/// A drawn case, which is determined by the campaign's seed and its number.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignCase<K> {
    /// Its number in the campaign, from 0.
    pub number: u64,
    /// Its kind.
    pub kind: K,
    /// Seed of its wind, loads and noise, and of its plant unless that was commissioned.
    pub seed: u64,
    /// Its faults, in the order of onset.
    pub faults: Vec<TimedFault>,
    /// Samples that do not reach diagnosers.
    pub gaps: Vec<SampleGap>,
    /// Number of its latest samples that the publisher stores for restarted diagnosers.
    pub kept_samples: usize,
    /// Its length.
    pub steps: u64,
}

impl<K> CampaignCase<K> {
    /// A case in which diagnosers receive every sample.
    pub(crate) fn new(
        number: u64,
        kind: K,
        seed: u64,
        faults: Vec<TimedFault>,
        steps: u64,
    ) -> Self {
        Self { number, kind, seed, faults, gaps: Vec::new(), kept_samples: 0, steps }
    }
}

/// Called after every step, with the rig and the events of the step.
pub type Watch<'a> = &'a mut dyn FnMut(&Rig, &[RigEvent]) -> Result<(), StudyError>;

/// A running case.
pub struct CaseRun<'a> {
    /// Plant and diagnosers.
    pub rig: Rig,
    /// All events so far, in order.
    pub occurrences: Vec<RigEvent>,
    gaps: &'a [SampleGap],
    steps_left: u64,
    watch: Watch<'a>,
}

impl<'a> CaseRun<'a> {
    /// The state before the first step. The rig must have the case's faults.
    pub fn new<K>(case: &'a CampaignCase<K>, mut rig: Rig, watch: Watch<'a>) -> Self {
        rig.keep_samples(case.kept_samples);
        Self { rig, occurrences: Vec::new(), gaps: &case.gaps, steps_left: case.steps, watch }
    }

    /// Advances by one step; `false` if the case has ended.
    ///
    /// # Errors
    /// A fault that does not fit the plant, or an error of the watch.
    pub fn step(&mut self) -> Result<bool, StudyError> {
        if self.steps_left == 0 {
            return Ok(false);
        }
        self.steps_left -= 1;
        let (gaps, step) = (self.gaps, self.rig.plant().next_step());
        for gap in gaps.iter().filter(|gap| gap.restarted && gap.until == step) {
            self.rig.restart(gap.place)?;
        }
        let is_hidden = |gap: &SampleGap| (gap.from..gap.until).contains(&step);
        self.rig
            .step_without(|place| gaps.iter().any(|gap| gap.place == place && is_hidden(gap)))?;
        let latest = self.rig.take_occurrences();
        (self.watch)(&self.rig, &latest)?;
        self.occurrences.extend(latest);
        Ok(true)
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// See [`Self::step`].
    pub fn finish(&mut self) -> Result<(), StudyError> {
        while self.step()? {}
        Ok(())
    }

    /// The components declared faulty so far, in order.
    #[must_use]
    pub fn diagnosed(&self) -> Vec<Diagnosed> {
        self.occurrences.iter().filter_map(RigEvent::diagnosed).collect()
    }
}
