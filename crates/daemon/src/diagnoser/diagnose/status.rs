//! The status of the diagnoser, for the network, metrics and readiness.

use diagnosis::Diagnoser;
use diagnosis::messages::Speaker;
use process::{ComponentStore, PresentComponent};
use shell::clock;
use vocabulary::{
    Condition, FaultState, FaultTransition, InquiryCounters, IntakeCounters, JournalStatus,
    Margins, ModulePhase, ModuleStatus, PeerStatus, PublisherCounters,
};

use crate::metrics::{AsideReport, ComponentReport, KindReport};

/// What neither the diagnoser nor the store knows.
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
    /// When the certificate of the process expires \[s since 1970\].
    pub(crate) certificate_until_unix_s: Option<u64>,
    /// Of each channel the largest excess of its divergence since the status before.
    pub(crate) largest_change: Vec<f64>,
}

pub(crate) fn compile(
    diagnoser: &Diagnoser,
    store: &ComponentStore,
    around: Surroundings<'_>,
) -> ModuleStatus {
    let count = |wanted: fn(&PresentComponent<'_>) -> bool| {
        store.present().filter(|present| wanted(present)).count() as u64
    };
    ModuleStatus {
        structure: around.speaker.structure.clone(),
        module: around.speaker.module.clone(),
        software: env!("CARGO_PKG_VERSION").to_owned(),
        thresholds: around.thresholds.to_owned(),
        reference: around.reference.map(str::to_owned),
        phase: around.phase,
        in_service_since_step: diagnoser.in_service_since(),
        run: diagnoser.run(),
        step: diagnoser.last_step(),
        lag_ms: around.lag_ms,
        sample_age_ms: around.sample_age_ms,
        queued_samples: around.queued_samples as u64,
        latched: count(|present| present.latest.is_some_and(|latest| latest.verdict.is_latched())),
        unconfirmed: count(|present| present.state == FaultState::Unconfirmed),
        unknown: count(|present| present.state == FaultState::Unknown),
        verified: count(|present| {
            present.condition.is_some_and(|known| matches!(known, Condition::Agrees { .. }))
        }),
        shelved: count(|present| present.latest.is_some_and(|latest| latest.aside().is_some())),
        suppressed: store.suppression().cloned(),
        waiting_questions: diagnoser.waiting_questions() as u64,
        next_sequence: diagnoser.next_sequence(),
        journal: around.journal,
        peers: around.peers,
        another_process: around.another_process,
        intake: around.intake,
        inquiries: around.inquiries,
        diagnosis: *diagnoser.counters(),
        publisher: around.publisher,
        certificate_until_unix_s: around.certificate_until_unix_s,
        margins: margins(diagnoser, &around.largest_change),
        time_unix_ns: clock::unix_ns(),
    }
}

/// How the diagnoser's components stand to their reference, in the order of the channels.
pub(crate) fn conditions(diagnoser: &Diagnoser) -> impl Iterator<Item = Condition> {
    diagnoser.conditions().cloned()
}

/// How near each component is to its limits, rounded to what is worth keeping.
fn margins(diagnoser: &Diagnoser, largest_change: &[f64]) -> Vec<Margins> {
    let rounded = |share: Option<f64>| share.map(|share| (1e4 * share).round() / 1e4);
    let of_channel = |(channel, change): (usize, &f64)| {
        let is_defined = diagnoser.evidence()[channel].divergence.is_some();
        let known = diagnoser.margins(channel);
        Margins {
            change: rounded(Some(*change).filter(|_| is_defined && known.change.is_none())),
            departure: rounded(known.departure),
            oil_content: rounded(known.oil_content),
            scatter: rounded(known.scatter),
            ..known
        }
    };
    largest_change.iter().enumerate().map(of_channel).collect()
}

/// How each component is.
pub(crate) fn of_components(store: &ComponentStore) -> Vec<ComponentReport> {
    let report = |present: PresentComponent<'_>| {
        let component = present.component.clone();
        let aside = present.latest.map(aside).unwrap_or_default();
        ComponentReport { component, state: present.state, aside }
    };
    store.present().map(report).collect()
}

/// What the present faults may be.
pub(crate) fn kinds(store: &ComponentStore) -> Vec<KindReport> {
    let kinds = store.identifications(|_| true).flat_map(|found| {
        found.candidates.iter().map(|candidate| KindReport {
            component: found.component.component.clone(),
            kind: candidate.kind,
            probability: candidate.probability,
        })
    });
    kinds.collect()
}

fn aside(latest: &FaultTransition) -> Vec<AsideReport> {
    let both = [("shelved", &latest.shelved), ("suppressed", &latest.suppressed)];
    let report = |(how, shelving): (&'static str, &Option<vocabulary::Shelving>)| {
        let until_unix_ns = shelving.as_ref()?.until_unix_ns;
        Some(AsideReport { how, until_unix_ns })
    };
    both.into_iter().filter_map(report).collect()
}
