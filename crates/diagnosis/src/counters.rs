//! What was counted since the start of the process.

use serde::{Deserialize, Serialize};

use crate::sample::SampleRejection;

/// Counters of events that must not go unnoticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counters {
    /// Samples used.
    pub samples: u64,
    /// Steps for which no sample came.
    pub samples_missing: u64,
    /// Samples whose step was the one before once more.
    pub samples_repeated: u64,
    /// Samples whose step lay before the one before.
    #[serde(default)]
    pub samples_late: u64,
    /// Samples whose step lay implausibly far ahead.
    pub samples_far_ahead: u64,
    /// Samples with the wrong number of values.
    pub samples_wrong_length: u64,
    /// Samples with a value that is missing, not a number or implausible; the others were used.
    pub samples_non_finite: u64,
    /// Runs begun.
    pub runs: u64,
    /// Gaussians lost and restarted.
    pub restarts: u64,
    /// Changes of any channel.
    pub changes: u64,
    /// Changes given up without a verdict, because too many of their channel were open.
    #[serde(default)]
    pub changes_unjudged: u64,
    /// Questions put to peers.
    pub questions_asked: u64,
    /// Questions that went unanswered: refused, timed out, absent or malformed.
    pub questions_unanswered: u64,
    /// Answers that did not fit a question.
    pub answers_malformed: u64,
    /// Verdicts that rested on a peer's word, by which it did not stand.
    #[serde(default)]
    pub verdicts_disputed: u64,
    /// Peers' questions answered.
    pub answers_given: u64,
    /// Peers' questions refused.
    pub questions_refused: u64,
}

impl Counters {
    /// Counts a sample that was not used.
    pub(crate) fn count(&mut self, rejection: SampleRejection) {
        let counter = match rejection {
            SampleRejection::WrongLength => &mut self.samples_wrong_length,
            SampleRejection::Repeated => &mut self.samples_repeated,
            SampleRejection::Late => &mut self.samples_late,
            SampleRejection::FarAhead => &mut self.samples_far_ahead,
        };
        *counter += 1;
    }
}
