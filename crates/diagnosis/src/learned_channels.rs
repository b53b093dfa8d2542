//! The channels of a learned module: readings → windows → what departs, is lost or cannot be told.

use vocabulary::{Condition, Evidence, Obstacle, Step};

use crate::channels::Occurrence;
use crate::sample::{Measurements, Signal};
use crate::settings::ModuleSetup;
use crate::state::learned::{ChannelState, DisplacedChannel, LearnedJudge, LearnedModule};

/// Windows from which on every channel is watched: either test needs two, one after the other.
const WATCHING: u64 = 2;

/// The judge of a learned module's readings, in the terms of a diagnoser.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct LearnedChannels {
    judge: LearnedJudge,
    /// The step of the first sample of the run; the judge counts samples from 0.
    begun: Option<Step>,
    /// Each channel as of the latest window.
    states: Vec<ChannelState>,
    conditions: Vec<Condition>,
    /// Did a window end at the latest step?
    ended: bool,
    incomplete: bool,
}

impl LearnedChannels {
    pub(crate) fn new(module: &LearnedModule, setup: &ModuleSetup) -> Self {
        let channels = module.channels.len();
        Self {
            judge: LearnedJudge::new(module.clone(), setup.step_s),
            begun: None,
            states: vec![ChannelState::Unknown; channels],
            conditions: vec![Condition::NotCompared; channels],
            ended: false,
            incomplete: false,
        }
    }

    /// A run begins.
    pub(crate) fn restart(&mut self) {
        self.judge.restart();
        self.begun = None;
        self.states.fill(ChannelState::Unknown);
        self.conditions.fill(Condition::NotCompared);
        self.ended = false;
    }

    /// So many samples are missing.
    pub(crate) fn skip(&mut self, missing: u64) {
        self.judge.skip(missing);
    }

    /// An operator has reset a channel.
    pub(crate) fn forgive(&mut self, channel: usize) {
        self.judge.forgive(channel);
        self.states[channel] = ChannelState::Unknown;
        self.conditions[channel] = Condition::NotCompared;
    }

    /// Takes the next sample; when a window ends with it, evidence and occurrences of each channel.
    pub(crate) fn take(
        &mut self,
        sample: &Measurements,
        evidence: &mut [Evidence],
        occurrences: &mut Vec<(usize, Occurrence)>,
    ) {
        let (now, readings) = (sample.step, &sample.elongations_m);
        self.begun.get_or_insert(now);
        self.incomplete = readings.iter().any(|reading| !reading.is_finite());
        let before = self.judge.windows();
        self.judge.take(readings);
        self.ended = self.judge.windows() > before;
        for (channel, evidence) in evidence.iter_mut().enumerate() {
            evidence.step = now;
            if self.ended {
                self.judged(channel, evidence, occurrences);
            }
        }
    }

    fn judged(
        &mut self,
        channel: usize,
        evidence: &mut Evidence,
        occurrences: &mut Vec<(usize, Occurrence)>,
    ) {
        let standing = self.judge.standing(channel);
        let before = std::mem::replace(&mut self.states[channel], standing.state);
        let is_new = before != standing.state;
        let begun = self.begun.unwrap_or(evidence.step);
        let (onset, as_of) = (begun.plus(standing.first), evidence.step);
        let from = as_of.minus(self.judge.per_window().saturating_sub(1));
        evidence.divergence = None;
        if let Some(found) = standing.found.filter(|_| standing.state != ChannelState::NoSignal) {
            evidence.residual = found.size;
            evidence.divergence = Some(found.statistic);
            evidence.threshold = found.threshold;
        }
        let cannot_tell = |obstacle| Condition::CannotTell { obstacle };
        self.conditions[channel] = match standing.state {
            ChannelState::Faulty => Condition::Departed { as_of },
            ChannelState::NoSignal => cannot_tell(Obstacle::NoSignal),
            ChannelState::Unknown => {
                cannot_tell(self.judge.obstacle().cloned().unwrap_or(Obstacle::UnseenLoads))
            }
            ChannelState::Normal if self.is_watching() => Condition::Agrees { from, as_of },
            ChannelState::Normal => Condition::NotCompared,
        };
        let occurrence = match standing.state {
            ChannelState::Faulty => {
                let before_service = standing.first == 0;
                Occurrence::Departed { onset, before_service }
            }
            ChannelState::NoSignal => {
                Occurrence::SignalLost { signal: Signal::Reading(channel), since: onset }
            }
            ChannelState::Normal | ChannelState::Unknown => return,
        };
        if is_new {
            occurrences.push((channel, occurrence));
        }
    }

    /// What tells the kind of a channel's fault.
    pub(crate) fn displaced(&self, channel: usize) -> Option<DisplacedChannel> {
        self.judge.displaced(channel)
    }

    /// Steps of a window.
    pub(crate) fn window_steps(&self) -> u64 {
        self.judge.per_window()
    }

    /// Is every channel compared?
    pub(crate) fn is_watching(&self) -> bool {
        self.judge.windows() >= WATCHING
    }

    /// Did a window end at the latest step?
    pub(crate) fn has_compared(&self) -> bool {
        self.ended
    }

    /// Lacks the latest sample any reading?
    pub(crate) fn is_incomplete(&self) -> bool {
        self.incomplete
    }

    pub(crate) fn condition(&self, channel: usize) -> &Condition {
        &self.conditions[channel]
    }

    /// How near a channel is to its limit in the latest window, negative if its reading is too small.
    pub(crate) fn share(&self, channel: usize) -> Option<f64> {
        let found = self.judge.standing(channel).found?;
        Some((found.statistic / found.threshold).copysign(found.size))
    }

    /// By how much the channel's readings are too large.
    pub(crate) fn departure(&self, channel: usize) -> Option<f64> {
        self.judge.standing(channel).found.map(|found| found.size)
    }
}
