//! How a module's diagnoser is.

use crate::{Component, ModuleName, RunId, Step, StructureName};
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
    /// Components whose alarm is shelved or suppressed.
    pub shelved: u64,
    /// If the alarms of all components are suppressed during maintenance: by whom, why and until when.
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
    /// When the certificate that it shows on the network expires \[s since 1970\]; `null` without one.
    pub certificate_until_unix_s: Option<u64>,
    /// How near each component is to its limits.
    pub margins: Vec<Margins>,
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
            certificate_until_unix_s: None,
            margins: Vec::new(),
            time_unix_ns: 0,
        }
    }
}

/// How near a component is to its limits: of each test, its statistic as a share of the threshold, with the sign of the
/// deviation. At 1 and -1 a fault is found. `null` while the test says nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Margins {
    /// The component.
    pub component: Component,
    /// Of the divergence, the largest since the status before, less what a cylinder's demand explains of it.
    pub change: Option<f64>,
    /// Of its mean against its reference, in the latest window in which peers were asked; in a learned module, of its
    /// reading.
    pub departure: Option<f64>,
    /// Of a cylinder's oil content against its reference.
    pub oil_content: Option<f64>,
    /// Of the logarithm of a gage's white noise against its reference.
    pub scatter: Option<f64>,
}

impl Margins {
    /// The names of the tests.
    pub const TESTS: [&str; 4] = ["change", "departure", "oil_content", "scatter"];

    /// Of a component of which no test says anything.
    #[must_use]
    pub fn unknown(component: Component) -> Self {
        Self { component, change: None, departure: None, oil_content: None, scatter: None }
    }

    /// Each test with its share of the limit.
    #[must_use]
    pub fn shares(&self) -> [(&'static str, Option<f64>); Self::TESTS.len()] {
        let shares = [self.change, self.departure, self.oil_content, self.scatter];
        std::array::from_fn(|test| (Self::TESTS[test], shares[test]))
    }
}

/// A counter of a status as a metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CounterMetric {
    /// The metric's name, without `_total`.
    pub name: &'static str,
    /// The value of the metric's label, if it is one of several counters.
    pub label: Option<&'static str>,
    /// What is counted, in a sentence.
    pub help: &'static str,
    /// How many there were since the start of the process.
    pub count: u64,
}

/// Makes the counters of a part of a status, each with the metric that it is and, among several counters of one metric,
/// its label. What is said of a counter is its metric's help.
macro_rules! counters {
    (
        $(#[$about:meta])+
        $part:ident {
            $( $(#[doc = $help:tt])+ $counter:ident => $metric:literal $($label:literal)?, )+
        }
    ) => {
        $(#[$about])+
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub struct $part {
            $( $(#[doc = $help])+ pub $counter: u64, )+
        }

        impl $part {
            /// Each counter as a metric.
            #[must_use]
            pub fn metrics(&self) -> Vec<CounterMetric> {
                vec![$( CounterMetric {
                    name: $metric,
                    label: [$( $label )?].first().copied(),
                    help: concat!($( $help ),+).trim_ascii(),
                    count: self.$counter,
                } ),+]
            }
        }
    };
}

counters! {
    /// Samples from the network, before they reach the diagnosis.
    IntakeCounters {
        /// Everything that came on the sample key.
        received => "trusswatch_samples_received",
        /// Samples dropped because the queue was full.
        dropped => "trusswatch_samples_rejected" "dropped",
        /// Samples that are not text or not JSON, or too long.
        malformed => "trusswatch_samples_rejected" "malformed",
        /// Samples without a version or of an unknown one.
        unknown_version => "trusswatch_samples_rejected" "unknown_version",
        /// JSON, but not a sample.
        wrong_message => "trusswatch_samples_rejected" "wrong_message",
        /// Samples of another module.
        other_module => "trusswatch_samples_rejected" "other_module",
        /// Samples of another publisher or run than the one being diagnosed, while that one goes on.
        other_source => "trusswatch_samples_rejected" "other_source",
        /// Samples, diagnosed all the same, whose time was not later than the one before's.
        clock_standing => "trusswatch_sample_timestamps_not_increasing",
        /// Missed samples recovered from the publisher.
        recovered => "trusswatch_samples_recovered",
        /// Queries for missed samples that recovered nothing.
        recoveries_failed => "trusswatch_recoveries_failed",
        /// Backlogs dropped to catch up with the present.
        resynchronised => "trusswatch_resynchronisations",
        /// Times that samples stopped.
        silences => "trusswatch_sample_timeouts",
    }
}

counters! {
    /// What others asked of this module, and what became of it. `received` is the sum of `malformed`,
    /// `turned_away`, `answered` and `refused`; what is missing from it waits to be answered.
    InquiryCounters {
        /// Requests received: queries for changes, faults and history, and commands.
        received => "trusswatch_requests_received",
        /// Requests that made no sense.
        malformed => "trusswatch_requests" "malformed",
        /// Requests that came while too many were waiting.
        turned_away => "trusswatch_requests" "turned_away",
        /// Requests answered, commands accepted among them.
        answered => "trusswatch_requests" "answered",
        /// Requests that made sense and were refused for a reason, commands among them.
        refused => "trusswatch_requests" "refused",
        /// Commands accepted.
        orders_obeyed => "trusswatch_commands" "accepted",
        /// Commands refused.
        orders_refused => "trusswatch_commands" "refused",
    }
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
    /// Questions to which no peer replied.
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

counters! {
    /// What the diagnosis counted since the start of the process.
    Counters {
        /// Samples diagnosed.
        samples => "trusswatch_samples_diagnosed",
        /// Steps for which no sample came.
        samples_missing => "trusswatch_samples_missing",
        /// Samples whose step was the one before once more.
        samples_repeated => "trusswatch_samples_rejected" "repeated",
        /// Samples whose step lay before the one before.
        samples_late => "trusswatch_samples_rejected" "late",
        /// Samples whose step lay implausibly far ahead.
        samples_far_ahead => "trusswatch_samples_rejected" "far_ahead",
        /// Samples with the wrong number of values.
        samples_wrong_length => "trusswatch_samples_rejected" "wrong_length",
        /// Samples with a value that is missing, not a number or implausible; the others were used.
        samples_non_finite => "trusswatch_samples_incomplete",
        /// Runs begun.
        runs => "trusswatch_runs",
        /// Channels lost and restarted.
        restarts => "trusswatch_channel_restarts",
        /// Times that a channel's divergence reached its threshold.
        changes => "trusswatch_changes",
        /// Changes given up without a verdict: too many of their channel were open.
        changes_unjudged => "trusswatch_changes_unjudged",
        /// Queries to peers.
        questions_asked => "trusswatch_questions_asked",
        /// Queries to peers that went unanswered: refused, timed out, absent or malformed.
        questions_unanswered => "trusswatch_questions_unanswered",
        /// Answers of peers that did not fit.
        answers_malformed => "trusswatch_answers_malformed",
        /// Explained changes whose explanation the peer did not stand by.
        verdicts_disputed => "trusswatch_verdicts_disputed",
        /// Peers' queries answered.
        answers_given => "trusswatch_questions_received" "answered",
        /// Peers' queries refused.
        questions_refused => "trusswatch_questions_received" "refused",
    }
}

counters! {
    /// Messages that should have gone out.
    PublisherCounters {
        /// Events published: transitions, identifications, changes, phases and inputs.
        events => "trusswatch_events_published",
        /// Events dropped because the outgoing queue was full. The journal has the transitions and identifications all
        /// the same.
        events_lost => "trusswatch_events_lost",
        /// Replies for which there was no room. The client gets no reply and asks again.
        replies_lost => "trusswatch_replies_lost",
    }
}

impl Message for ModuleStatus {
    const WHAT: &'static str = "module status";
}
