//! How the diagnoser is.

use diagnosis::{Diagnoser, Verdict};
use wire::{IntakeCounters, ModuleStatus, PublisherCounters};

use crate::clock;
use crate::convert::{Speaker, to_counters, to_phase};

/// What the diagnoser itself does not know.
#[derive(Debug)]
pub(crate) struct Surroundings<'a> {
    pub(crate) speaker: &'a Speaker,
    pub(crate) thresholds: &'a str,
    pub(crate) lag_ms: Option<f64>,
    pub(crate) queued_samples: usize,
    pub(crate) intake: IntakeCounters,
    pub(crate) publisher: PublisherCounters,
}

pub(crate) fn compile(diagnoser: &Diagnoser, around: Surroundings<'_>) -> ModuleStatus {
    let (phase, in_service_since_step) = to_phase(diagnoser.phase());
    let count = |wanted: fn(&Verdict) -> bool| {
        diagnoser.verdicts().filter(|(_, verdict)| wanted(verdict)).count() as u64
    };
    ModuleStatus {
        structure: around.speaker.structure.clone(),
        module: around.speaker.module.clone(),
        software: env!("CARGO_PKG_VERSION").to_owned(),
        thresholds: around.thresholds.to_owned(),
        phase,
        in_service_since_step,
        run: diagnoser.run(),
        step: diagnoser.last_step(),
        lag_ms: around.lag_ms,
        queued_samples: around.queued_samples as u64,
        latched: count(Verdict::is_latched),
        unconfirmed: count(|verdict| matches!(verdict, Verdict::Unconfirmed { .. })),
        waiting_questions: diagnoser.waiting_questions() as u64,
        next_sequence: diagnoser.next_sequence(),
        intake: around.intake,
        diagnosis: to_counters(diagnoser.counters()),
        publisher: around.publisher,
        time_unix_ns: clock::unix_ns(),
    }
}
