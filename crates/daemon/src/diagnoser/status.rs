//! How the diagnoser is.

use diagnosis::{Diagnoser, Evidence, Transition, Verdict};
use shell::clock;
use vocabulary::{
    Component, Condition, FaultState, InquiryCounters, IntakeCounters, JournalStatus, ModulePhase,
    ModuleStatus, PeerStatus, PublisherCounters,
};

use super::set_aside;
use crate::metrics::{AsideReport, ComponentReport};
use diagnosis::messages::{Speaker, to_phase};

/// What the diagnoser itself does not know.
#[derive(Debug)]
pub(crate) struct Surroundings<'a> {
    pub(crate) speaker: &'a Speaker,
    pub(crate) thresholds: &'a str,
    pub(crate) reference: Option<&'a str>,
    pub(crate) phase: ModulePhase,
    pub(crate) lag_ms: Option<f64>,
    pub(crate) sample_age_ms: Option<f64>,
    pub(crate) queued_samples: usize,
    pub(crate) journal: JournalStatus,
    pub(crate) peers: Vec<PeerStatus>,
    pub(crate) another_process: bool,
    pub(crate) intake: IntakeCounters,
    pub(crate) inquiries: InquiryCounters,
    pub(crate) publisher: PublisherCounters,
}

pub(crate) fn compile(diagnoser: &Diagnoser, around: Surroundings<'_>) -> ModuleStatus {
    let (_, in_service_since_step) = to_phase(diagnoser.phase());
    let unknown = of_components(diagnoser, around.phase)
        .iter()
        .filter(|report| report.state == FaultState::Unknown)
        .count() as u64;
    let count = |wanted: fn(&Verdict) -> bool| {
        diagnoser.verdicts().filter(|(_, verdict)| wanted(verdict)).count() as u64
    };
    let agrees = |condition: &&Condition| matches!(condition, Condition::Agrees { .. });
    ModuleStatus {
        structure: around.speaker.structure.clone(),
        module: around.speaker.module.clone(),
        software: env!("CARGO_PKG_VERSION").to_owned(),
        thresholds: around.thresholds.to_owned(),
        reference: around.reference.map(str::to_owned),
        phase: around.phase,
        in_service_since_step,
        run: diagnoser.run(),
        step: diagnoser.last_step(),
        lag_ms: around.lag_ms,
        sample_age_ms: around.sample_age_ms,
        queued_samples: around.queued_samples as u64,
        latched: count(Verdict::is_latched),
        unconfirmed: count(|verdict| matches!(verdict, Verdict::Unconfirmed { .. })),
        unknown,
        verified: diagnoser.conditions().filter(agrees).count() as u64,
        shelved: set_aside::count(diagnoser),
        suppressed: set_aside::suppression(diagnoser),
        waiting_questions: diagnoser.waiting_questions() as u64,
        next_sequence: diagnoser.next_sequence(),
        journal: around.journal,
        peers: around.peers,
        another_process: around.another_process,
        intake: around.intake,
        inquiries: around.inquiries,
        diagnosis: *diagnoser.counters(),
        publisher: around.publisher,
        time_unix_ns: clock::unix_ns(),
    }
}

/// How each component is, in this phase.
pub(crate) fn of_components(diagnoser: &Diagnoser, phase: ModulePhase) -> Vec<ComponentReport> {
    let each = diagnoser.verdicts().zip(diagnoser.evidence()).zip(diagnoser.conditions());
    let report = |(((component, verdict), evidence), condition): (
        ((&Component, &Verdict), &Evidence),
        &Condition,
    )| {
        let is_hidden = phase != ModulePhase::InService || !condition.allows_normal();
        let ratio = evidence.divergence.map(|_| evidence.ratio());
        let state = match verdict.state() {
            FaultState::Normal if is_hidden => FaultState::Unknown,
            state => state,
        };
        let aside = diagnoser.last_transition(component).map(aside).unwrap_or_default();
        ComponentReport { component: component.clone(), state, ratio, aside }
    };
    each.map(report).collect()
}

fn aside(latest: &Transition) -> Vec<AsideReport> {
    let spans = set_aside::spans(latest);
    spans
        .map(|(how, shelving)| AsideReport { how, until_unix_ns: shelving.until_unix_ns })
        .collect()
}
