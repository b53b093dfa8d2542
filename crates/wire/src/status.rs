//! How a module's diagnoser is.

use serde::{Deserialize, Serialize};
use truss::ids::{ModuleName, RunId, Step, StructureName};

use crate::encoding::Message;

/// Whether verdicts can be given yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ModulePhase {
    /// No sample yet.
    Waiting,
    /// Some channel rests on too few vectors to be judged.
    Initialising,
    /// Every channel is watched.
    InService,
}

/// A diagnoser's status, once a second and at each change of phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModuleStatus {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Version of the software.
    pub software: String,
    /// Fingerprint of the thresholds in use.
    pub thresholds: String,
    /// Whether verdicts can be given yet.
    pub phase: ModulePhase,
    /// Since which step every channel is watched.
    pub in_service_since_step: Option<Step>,
    /// The present run.
    pub run: Option<RunId>,
    /// The latest step processed.
    pub step: Option<Step>,
    /// From the latest sample's publication to its diagnosis, by the clocks of both \[ms\].
    pub lag_ms: Option<f64>,
    /// Samples that wait to be processed.
    pub queued_samples: u64,
    /// Components held for faulty.
    pub latched: u64,
    /// Changes that cannot be judged because peers do not answer.
    pub unconfirmed: u64,
    /// Peers' questions that wait for a step to come.
    pub waiting_questions: u64,
    /// The sequence number that the next transition will have.
    pub next_sequence: u64,
    /// What came in.
    pub intake: IntakeCounters,
    /// What became of it.
    pub diagnosis: DiagnosisCounters,
    /// What went out.
    pub publisher: PublisherCounters,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

/// Samples from the network, before they reach the diagnosis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct IntakeCounters {
    /// Everything that came on the sample key.
    pub received: u64,
    /// Dropped because the queue was full.
    pub dropped: u64,
    /// Not text or not JSON, or too long.
    pub malformed: u64,
    /// Without a version or of an unknown one.
    pub unknown_version: u64,
    /// JSON, but not a sample.
    pub wrong_message: u64,
    /// Samples of another module.
    pub other_module: u64,
}

/// The counters of the diagnosis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosisCounters {
    /// Samples used.
    pub samples: u64,
    /// Steps for which no sample came.
    pub samples_missing: u64,
    /// Samples whose step was seen before or went backwards.
    pub samples_repeated: u64,
    /// Samples whose step lay implausibly far ahead.
    #[serde(default)]
    pub samples_far_ahead: u64,
    /// Samples with the wrong number of values.
    pub samples_wrong_length: u64,
    /// Samples with a value that is not a finite number.
    pub samples_non_finite: u64,
    /// Runs begun.
    pub runs: u64,
    /// Gaussians lost and started anew.
    pub restarts: u64,
    /// Changes of any channel.
    pub changes: u64,
    /// Questions put to peers.
    pub questions_asked: u64,
    /// Questions that went unanswered.
    pub questions_unanswered: u64,
    /// Answers that did not fit a question.
    pub answers_malformed: u64,
    /// Peers' questions answered.
    pub answers_given: u64,
    /// Peers' questions refused.
    pub questions_refused: u64,
}

/// Messages that should have gone out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PublisherCounters {
    /// Fault transitions and changes published.
    pub events: u64,
    /// Fault transitions and changes that the network would not take in time.
    pub events_lost: u64,
    /// Questions of others that came while too many were waiting.
    pub questions_turned_away: u64,
}

impl Message for ModuleStatus {
    const WHAT: &'static str = "module status";
}
