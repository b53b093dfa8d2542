//! The status of the module, for the network, metrics and readiness.

use vocabulary::{
    Condition, FaultState, InquiryCounters, IntakeCounters, Margins, ModuleStatus, PeerStatus,
    PublisherCounters,
};

use super::{ModuleProcess, Now};
use crate::components::PresentComponent;
use crate::store_state::StoreState;

/// What of a status is known outside.
#[derive(Debug, Default)]
pub struct StatusSurroundings {
    /// Samples that wait to be handed in.
    pub queued_samples: usize,
    /// The peers.
    pub peers: Vec<PeerStatus>,
    /// Does another process run as the same module?
    pub another_process: bool,
    /// Of what comes in, what is counted outside.
    pub intake: IntakeCounters,
    /// Of what is asked, what is counted outside.
    pub inquiries: InquiryCounters,
    /// What was published.
    pub publisher: PublisherCounters,
    /// When the certificate of the process expires \[s since 1970\].
    pub certificate_until_unix_s: Option<u64>,
}

impl<Q> ModuleProcess<Q> {
    /// The present status. The largest changes in it are those since the status before.
    pub fn status(
        &mut self,
        store: &StoreState,
        around: StatusSurroundings,
        now: Now,
    ) -> ModuleStatus {
        let components = &store.components;
        let count = |wanted: fn(&PresentComponent<'_>) -> bool| {
            components.present().filter(|present| wanted(present)).count() as u64
        };
        let diagnoser = &self.diagnoser;
        let own = self.intake;
        let intake = IntakeCounters {
            silences: around.intake.silences + own.silences,
            clock_standing: around.intake.clock_standing + own.clock_standing,
            dropped: around.intake.dropped + own.dropped,
            resynchronised: around.intake.resynchronised + own.resynchronised,
            ..around.intake
        };
        let inquiries = InquiryCounters {
            refused: around.inquiries.refused + self.inquiries.refused,
            orders_refused: around.inquiries.orders_refused + self.inquiries.orders_refused,
            orders_obeyed: around.inquiries.orders_obeyed + self.inquiries.orders_obeyed,
            ..around.inquiries
        };
        let status = ModuleStatus {
            structure: self.speaker.structure.clone(),
            module: self.speaker.module.clone(),
            software: env!("CARGO_PKG_VERSION").to_owned(),
            thresholds: self.settings.thresholds.clone(),
            reference: self.settings.reference.clone(),
            phase: self.phase(),
            in_service_since_step: diagnoser.in_service_since(),
            run: diagnoser.run(),
            step: diagnoser.last_step(),
            lag_ms: self.lag_ms,
            sample_age_ms: self
                .latest_sample_unix_ns
                .map(|published| ms_between(published, now.unix_ns)),
            queued_samples: (around.queued_samples + self.sequencer.len()) as u64,
            latched: count(|present| {
                present.latest.is_some_and(|latest| latest.verdict.is_latched())
            }),
            unconfirmed: count(|present| present.state == FaultState::Unconfirmed),
            unknown: count(|present| present.state == FaultState::Unknown),
            verified: count(|present| {
                present.condition.is_some_and(|known| matches!(known, Condition::Agrees { .. }))
            }),
            shelved: count(|present| present.latest.is_some_and(|latest| latest.aside().is_some())),
            suppressed: components.suppression().cloned(),
            waiting_questions: diagnoser.waiting_questions() as u64,
            next_sequence: diagnoser.next_sequence(),
            journal: store.writes.status(now.at),
            peers: around.peers,
            another_process: around.another_process,
            intake,
            inquiries,
            diagnosis: *diagnoser.counters(),
            publisher: around.publisher,
            certificate_until_unix_s: around.certificate_until_unix_s,
            margins: self.margins(),
            time_unix_ns: now.unix_ns,
        };
        self.largest_change.fill(0.0);
        status
    }

    /// How near each component is to its limits, rounded to what is worth keeping.
    fn margins(&self) -> Vec<Margins> {
        let rounded = |share: Option<f64>| share.map(|share| (1e4 * share).round() / 1e4);
        let of_channel = |(channel, change): (usize, &f64)| {
            let is_defined = self.diagnoser.evidence()[channel].divergence.is_some();
            let known = self.diagnoser.margins(channel);
            Margins {
                change: rounded(Some(*change).filter(|_| is_defined && known.change.is_none())),
                departure: rounded(known.departure),
                oil_content: rounded(known.oil_content),
                scatter: rounded(known.scatter),
                ..known
            }
        };
        self.largest_change.iter().enumerate().map(of_channel).collect()
    }
}

/// Milliseconds from a time on another's clock to one on ours; negative if that clock is ahead.
pub(super) fn ms_between(theirs_unix_ns: u64, ours_unix_ns: u64) -> f64 {
    let elapsed_ns = i128::from(ours_unix_ns) - i128::from(theirs_unix_ns);
    // A display value, and small.
    #[expect(clippy::cast_precision_loss, reason = "a display value")]
    let ms = elapsed_ns as f64 / 1e6;
    ms
}
