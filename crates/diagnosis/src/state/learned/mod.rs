//! A module's reference that is learnt from recordings alone, without a structural model.
//!
//! The readings are channels: sensors, which follow from the loads, and inputs, the loads as measured. Medians of short
//! windows of all of them are compared with one Gaussian (the reference), and their differences over six windows with
//! another (the change). The covariance of the reference is that of what a regression on the inputs leaves of recordings
//! that it was not learnt from; in it a displaced input is as well defined as a displaced sensor. As many recordings,
//! not as many windows, are known: n in z'² is the number of recordings.
//!
//! | file | what |
//! |---|---|
//! | `window` | medians of windows; which samples are no measurements |
//! | `cleaning` | windows of a healthy recording that are taken for faults |
//! | `learning` | recordings to a [`LearnedModule`] |
//! | `judge` | a stream of samples to verdicts |
//! | `kind` | kind and size of a displaced channel |
//! | `document` | all of it as machine output |

mod cleaning;
mod document;
mod judge;
mod kind;
mod learning;
mod window;

use serde::{Deserialize, Serialize};

use super::gaussian::Gaussian;

pub use cleaning::CleanedInterval;
pub use judge::{ChannelState, ChannelSummary, ChannelVerdict, LearnedJudge};
pub(crate) use kind::DisplacedChannel;
pub use kind::FittedKind;
pub use learning::{HealthyRecording, LearningError, LearningSettings, Learnt, learn};

/// Version of [`LearnedModule`] as a file.
pub const LEARNED_VERSION: u32 = 1;

/// The first line of such a file.
pub const LEARNED_HEADING: &str =
    "# What a healthy structure's sensors read, learnt by `trusswatch learn`\n";

/// A channel as it was in the healthy recordings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedChannel {
    /// Name of its column.
    pub name: String,
    /// Lowest and highest median of a window, in the channel's unit.
    pub lowest: f64,
    /// See `lowest`.
    pub highest: f64,
    /// How long it may keep one value before it counts as dead \[s\].
    pub longest_constant_s: f64,
    /// The smallest displacement that its reference finds in most cases, in the channel's unit; infinite if it finds none.
    #[serde(deserialize_with = "crate::settings::infinite_if_none")]
    pub smallest_found: f64,
}

impl LearnedChannel {
    /// Highest less lowest.
    pub fn range(&self) -> f64 {
        self.highest - self.lowest
    }

    /// Is its smallest fault that can be found so large that it cannot be judged?
    pub fn is_beyond_judging(&self) -> bool {
        self.smallest_found > 0.5 * self.range()
    }
}

/// What was learnt of a module. Channels are the sensors, then the inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedModule {
    /// [`LEARNED_VERSION`].
    pub v: u32,
    /// Length of a window \[s\].
    pub window_s: f64,
    /// Number of sensors; the channels after them are inputs.
    pub sensors: usize,
    /// Directions in which the inputs moved.
    pub directions: usize,
    /// z' of the reference above which a channel departs.
    pub reference_threshold: f64,
    /// z' of a change.
    pub change_threshold: f64,
    /// Root of the distance of all channels from the reference above which the structure itself may differ.
    pub distance_threshold: f64,
    /// Names of the recordings that it was learnt from.
    pub recordings: Vec<String>,
    /// Hours of them that were used.
    pub hours: f64,
    /// Each channel.
    pub channels: Vec<LearnedChannel>,
    /// Medians of a window.
    pub reference: Gaussian,
    /// Mean of two windows less that of the four before.
    pub change: Gaussian,
}

/// Samples may be so many windows apart: what a clock of times makes of one.
const FARTHEST: f64 = 1.5;

impl LearnedModule {
    /// Are samples so far apart \[s\] that they do not fill its windows?
    ///
    /// # Errors
    /// In words, what would be right.
    pub fn check_step(&self, step_s: f64) -> Result<(), String> {
        if step_s > 0.0 && step_s <= FARTHEST * self.window_s {
            return Ok(());
        }
        let window_s = self.window_s;
        Err(format!(
            "samples are {step_s} s apart, but the module compares medians of {window_s} s; give it samples as close \
             as those that it was learnt from, or learn with --window {step_s}"
        ))
    }

    /// Distinguishes it from other learned modules.
    #[must_use]
    pub fn fingerprint(&self) -> String {
        super::fingerprint(&format!("{self:?}"))
    }

    /// What makes it unusable, in words.
    ///
    /// # Errors
    /// The offending key and what would be right.
    pub fn check(&self) -> Result<(), String> {
        let size = self.channels.len();
        if self.v != LEARNED_VERSION {
            let v = self.v;
            return Err(format!("`v` is {v}; this program reads version {LEARNED_VERSION}"));
        }
        if !(self.window_s.is_finite() && self.window_s > 0.0) {
            return Err(format!("`window_s` is {}; use seconds above 0", self.window_s));
        }
        if self.sensors == 0 || self.sensors >= size {
            return Err(format!(
                "`sensors` is {}; use 1 to {}, since at least one channel is an input",
                self.sensors,
                size.saturating_sub(1)
            ));
        }
        for (name, threshold) in [
            ("reference", self.reference_threshold),
            ("change", self.change_threshold),
            ("distance", self.distance_threshold),
        ] {
            if !(threshold.is_finite() && threshold > 0.0) {
                return Err(format!("`{name}_threshold` is {threshold}; use a number above 0"));
            }
        }
        let ordered = |c: &&LearnedChannel| !(c.lowest.is_finite() && c.lowest <= c.highest);
        if let Some(channel) = self.channels.iter().find(ordered) {
            return Err(format!("`lowest` of `{}` is not below `highest`", channel.name));
        }
        for (name, gaussian) in [("reference", &self.reference), ("change", &self.change)] {
            if !gaussian.is_sound(size) {
                return Err(format!("`{name}` is not a Gaussian of {size} channels"));
            }
        }
        Ok(())
    }
}
