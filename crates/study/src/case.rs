//! One run of a plant and its diagnosers: what is drawn of it, and how it goes.

use vocabulary::Step;

use crate::error::StudyError;
use crate::rig::{Diagnosed, Rig, RigEvent, TimedFault};

/// Steps whose samples one diagnoser does not get.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleGap {
    /// Place of the diagnoser.
    pub place: usize,
    /// First step that it does not get.
    pub from: Step,
    /// First step that it gets again.
    pub until: Step,
    /// It is restarted before that step, with what it had stored and the samples that the publisher still keeps.
    pub restarted: bool,
}

/// One run as it is drawn. It follows from the campaign's seed and its number alone.
#[derive(Debug, Clone, PartialEq)]
pub struct CampaignCase<K> {
    /// Its number in the campaign, from 0.
    pub number: u64,
    /// What it is an example of.
    pub kind: K,
    /// Seed of its wind, loads and noise, and of its plant if that is not commissioned beforehand.
    pub seed: u64,
    /// Its faults, in the order in which they begin.
    pub faults: Vec<TimedFault>,
    /// What diagnosers do not see.
    pub gaps: Vec<SampleGap>,
    /// So many of its latest samples the publisher keeps for diagnosers that are restarted.
    pub kept_samples: usize,
    /// Its length.
    pub steps: u64,
}

impl<K> CampaignCase<K> {
    /// A case whose diagnosers see every sample.
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

/// Sees the rig after every step, with what happened in it.
pub type Watch<'a> = &'a mut dyn FnMut(&Rig, &[RigEvent]) -> Result<(), StudyError>;

/// A case while it runs.
pub struct CaseRun<'a> {
    /// Plant and diagnosers.
    pub rig: Rig,
    /// What happened so far, in order.
    pub occurrences: Vec<RigEvent>,
    gaps: &'a [SampleGap],
    steps_left: u64,
    watch: Watch<'a>,
}

impl<'a> CaseRun<'a> {
    /// Before its first step. The rig has the case's faults.
    pub fn new<K>(case: &'a CampaignCase<K>, mut rig: Rig, watch: Watch<'a>) -> Self {
        rig.keep_samples(case.kept_samples);
        Self { rig, occurrences: Vec::new(), gaps: &case.gaps, steps_left: case.steps, watch }
    }

    /// Goes on by one step; `false` if it was over.
    ///
    /// # Errors
    /// A fault that does not fit the plant, or what the watch fails with.
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

    /// Goes on to its end.
    ///
    /// # Errors
    /// See [`Self::step`].
    pub fn finish(&mut self) -> Result<(), StudyError> {
        while self.step()? {}
        Ok(())
    }

    /// What was declared faulty so far, in order.
    #[must_use]
    pub fn diagnosed(&self) -> Vec<Diagnosed> {
        self.occurrences.iter().filter_map(RigEvent::diagnosed).collect()
    }
}
