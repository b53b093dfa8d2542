//! How a module's diagnoser is.

use crate::{ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::phase::ModulePhase;
use crate::shelving::Shelving;

/// A diagnoser's status, once a second and at each change of phase.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModuleStatus {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Version of the software.
    pub software: String,
    /// Fingerprint of the thresholds in use.
    pub thresholds: String,
    /// Fingerprint of the reference in use, if there is one.
    pub reference: Option<String>,
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
    /// How long ago the latest sample processed was published \[ms\], at the time of this status.
    pub sample_age_ms: Option<f64>,
    /// Samples that wait to be processed.
    pub queued_samples: u64,
    /// Components held for faulty, acknowledged or not.
    pub latched: u64,
    /// Components whose verdict is unconfirmed.
    pub unconfirmed: u64,
    /// Components of which nothing is known, since the module does not watch them at present or cannot compare them
    /// with their reference.
    pub unknown: u64,
    /// Components that agree with their reference as of the latest window.
    pub verified: u64,
    /// Components whose alarm is set aside, shelved or suppressed.
    pub shelved: u64,
    /// If the alarms of all of them are set aside while the module is maintained, by whom, why and until when.
    pub suppressed: Option<Shelving>,
    /// Peers' questions that wait for a step to come.
    pub waiting_questions: u64,
    /// The sequence number that the next transition will have.
    pub next_sequence: u64,
    /// The journal.
    pub journal: JournalStatus,
    /// Each peer.
    pub peers: Vec<PeerStatus>,
    /// Whether another process runs as this module: it keeps publishing a status of its own.
    pub another_process: bool,
    /// What came in.
    pub intake: IntakeCounters,
    /// What others asked.
    pub inquiries: InquiryCounters,
    /// What became of it.
    pub diagnosis: Counters,
    /// What went out.
    pub publisher: PublisherCounters,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
}

impl ModuleStatus {
    /// Of a module that waits for its first sample, and of which there is nothing else to say.
    #[must_use]
    pub fn waiting(structure: StructureName, module: ModuleName) -> Self {
        Self {
            structure,
            module,
            software: String::new(),
            thresholds: String::new(),
            reference: None,
            phase: ModulePhase::Waiting,
            in_service_since_step: None,
            run: None,
            step: None,
            lag_ms: None,
            sample_age_ms: None,
            queued_samples: 0,
            latched: 0,
            unconfirmed: 0,
            unknown: 0,
            verified: 0,
            shelved: 0,
            suppressed: None,
            waiting_questions: 0,
            next_sequence: 1,
            journal: JournalStatus::default(),
            peers: Vec::new(),
            another_process: false,
            intake: IntakeCounters::default(),
            inquiries: InquiryCounters::default(),
            diagnosis: Counters::default(),
            publisher: PublisherCounters::default(),
            time_unix_ns: 0,
        }
    }
}

/// Samples from the network, before they reach the diagnosis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
    /// Samples of another publisher or run than the one being diagnosed, while that one goes on.
    pub other_source: u64,
    /// Samples whose time is not later than that of the one before. They are used: steps decide.
    pub clock_standing: u64,
    /// Samples that were missed and had from the publisher's store.
    pub recovered: u64,
    /// Questions to the publisher's store that brought nothing.
    pub recoveries_failed: u64,
    /// How often the backlog was thrown away to get back to the present.
    pub resynchronised: u64,
    /// How often samples stopped coming.
    pub silences: u64,
}

/// What others asked of this module, and what became of it. `received` is the sum of `malformed`,
/// `turned_away`, `answered` and `refused`; what is missing from it waits to be answered.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct InquiryCounters {
    /// Questions on the keys of state, faults, history and commands.
    pub received: u64,
    /// Those that made no sense.
    pub malformed: u64,
    /// Those that came while too many were waiting.
    pub turned_away: u64,
    /// Those answered, orders obeyed among them.
    pub answered: u64,
    /// Those that made sense and were refused for a reason, orders among them.
    pub refused: u64,
    /// Orders obeyed.
    pub orders_obeyed: u64,
    /// Orders refused.
    pub orders_refused: u64,
}

/// The file that transitions are written to before they are published.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct JournalStatus {
    /// Where it is; `null` without one.
    pub directory: Option<String>,
    /// Its size.
    pub bytes: u64,
    /// Why nothing can be written at present, if so.
    pub problem: Option<String>,
    /// Records that wait to be written.
    pub unsaved: u64,
    /// Records given up because too many were waiting.
    pub lost: u64,
    /// Damaged records found at the start and passed over.
    pub damaged: u64,
    /// When it began \[ms since 1970\]: what sequence numbers count in.
    pub incarnation: u64,
}

/// How a question to a peer ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PeerOutcome {
    /// With an answer.
    Answered,
    /// With a refusal.
    Refused,
    /// With none in time.
    TimedOut,
    /// Nobody was there.
    Absent,
    /// With an answer that did not fit, or with several that contradict each other.
    Malformed,
}

/// A peer as this module sees it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PeerStatus {
    /// The peer.
    pub module: ModuleName,
    /// Whether its liveliness token is there.
    pub present: bool,
    /// How the latest question ended.
    pub latest: Option<PeerOutcome>,
    /// The words of its latest refusal, or what was wrong with its latest answer.
    pub reason: Option<String>,
    /// Questions that it answered.
    pub answered: u64,
    /// Questions that it refused.
    pub refused: u64,
    /// Questions that it did not answer in time.
    pub timed_out: u64,
    /// Questions that met nobody.
    pub absent: u64,
    /// Answers that did not fit, or contradict a former one.
    pub malformed: u64,
    /// Verdicts that it was said to explain, and by which it did not stand.
    pub disputed: u64,
}

impl PeerStatus {
    /// A peer that has neither been seen nor asked.
    #[must_use]
    pub fn unasked(module: ModuleName) -> Self {
        Self {
            module,
            present: false,
            latest: None,
            reason: None,
            answered: 0,
            refused: 0,
            timed_out: 0,
            absent: 0,
            malformed: 0,
            disputed: 0,
        }
    }
}

/// What the diagnosis counted since the start of the process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Counters {
    /// Samples used.
    pub samples: u64,
    /// Steps for which no sample came.
    pub samples_missing: u64,
    /// Samples whose step was the one before once more.
    pub samples_repeated: u64,
    /// Samples whose step lay before the one before.
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
    pub changes_unjudged: u64,
    /// Questions put to peers.
    pub questions_asked: u64,
    /// Questions that went unanswered: refused, timed out, absent or malformed.
    pub questions_unanswered: u64,
    /// Answers that did not fit a question.
    pub answers_malformed: u64,
    /// Verdicts that rested on a peer's word, by which it did not stand.
    pub verdicts_disputed: u64,
    /// Peers' questions answered.
    pub answers_given: u64,
    /// Peers' questions refused.
    pub questions_refused: u64,
}

/// Messages that should have gone out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PublisherCounters {
    /// Transitions, identifications, changes, phases and inputs published.
    pub events: u64,
    /// Those of them that were dropped because the network took nothing for too long. The journal has the transitions and
    /// identifications all the same.
    pub events_lost: u64,
    /// Replies for which there was no room. Whoever asked hears nothing, and asks again.
    pub replies_lost: u64,
}

impl Message for ModuleStatus {
    const WHAT: &'static str = "module status";
}
