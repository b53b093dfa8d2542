//! What a diagnoser counts.

use std::borrow::Cow;
use std::fmt;
use std::time::Duration;

use vocabulary::{
    Component, FaultState, IdentifiedKind, JournalStatus, Margins, ModulePhase, ModuleStatus,
    PeerStatus,
};

use shell::health::Sheet;

const PHASES: [ModulePhase; 4] =
    [ModulePhase::Waiting, ModulePhase::Initialising, ModulePhase::InService, ModulePhase::Stale];
const STATES: [FaultState; 7] = [
    FaultState::Normal,
    FaultState::Unknown,
    FaultState::Tentative,
    FaultState::Unconfirmed,
    FaultState::Explained,
    FaultState::Latched,
    FaultState::Acknowledged,
];

/// How an alarm can be shelved or suppressed.
const HOW: [&str; 2] = ["shelved", "suppressed"];

/// The metrics that have a counter for each value of a label, with their help and the label.
const LABELLED: [(&str, &str, &str); 4] = [
    ("trusswatch_samples_rejected", "Samples that were not diagnosed, by reason.", "reason"),
    ("trusswatch_questions_received", "Peers' queries, by outcome.", "outcome"),
    ("trusswatch_requests", "Requests, by outcome.", "outcome"),
    ("trusswatch_commands", "Operators' commands.", "outcome"),
];

/// A diagnoser as it was when it last published its status.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModuleReport {
    /// The status as published.
    pub(crate) status: ModuleStatus,
    /// Why it is in its phase.
    pub(crate) reason: String,
    /// Each component of the module.
    pub(crate) components: Vec<ComponentReport>,
    /// What was identified.
    pub(crate) identifications: IdentificationReport,
}

/// A component as the module sees it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ComponentReport {
    pub(crate) component: Component,
    pub(crate) state: FaultState,
    /// The shelving and suppression of its alarm.
    pub(crate) aside: Vec<AsideReport>,
}

/// The shelving or suppression of an alarm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct AsideReport {
    /// `shelved` or `suppressed`.
    pub(crate) how: &'static str,
    /// Its end \[ns since 1970\].
    pub(crate) until_unix_ns: u64,
}

/// What was identified since the process began.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct IdentificationReport {
    /// How often faults were identified.
    pub(crate) done: u64,
    /// How long that took altogether.
    pub(crate) took: Duration,
    /// How often there was no room for another request.
    pub(crate) turned_away: u64,
    /// How often an identification failed, a defect of this program.
    pub(crate) failed: u64,
    /// How often there was news.
    pub(crate) published: u64,
    /// What the present faults may be.
    pub(crate) kinds: Vec<KindReport>,
}

/// A kind that a present fault may be of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KindReport {
    pub(crate) component: Component,
    pub(crate) kind: IdentifiedKind,
    pub(crate) probability: f64,
}

pub(super) fn write(report: &ModuleReport, sheet: &mut Sheet<'_>) -> fmt::Result {
    let ModuleReport { status, components, identifications, reason: _ } = report;
    write_present(status, sheet)?;
    write_components(components, sheet)?;
    write_margins(&status.margins, sheet)?;
    write_set_aside(status, components, sheet)?;
    let help = "Components that agree with their reference as of the latest window.";
    sheet.gauge("trusswatch_components_verified", help, status.verified)?;
    write_identifications(identifications, sheet)?;
    write_counters(status, sheet)?;
    write_journal(&status.journal, sheet)?;
    write_peers(&status.peers, sheet)
}

fn write_present(status: &ModuleStatus, sheet: &mut Sheet<'_>) -> fmt::Result {
    sheet.info(
        "trusswatch_thresholds",
        "The thresholds in use.",
        ("fingerprint", &status.thresholds),
    )?;
    if let Some(reference) = &status.reference {
        sheet.info("trusswatch_reference", "The reference in use.", ("fingerprint", reference))?;
    }
    let help = "When the status was published, which all metrics but the process's are of.";
    let published_s = seconds_of_ns(status.time_unix_ns);
    sheet.seconds("trusswatch_status_timestamp", help, Some(published_s))?;
    sheet.certificate_expiry(status.certificate_until_unix_s)?;
    let phases = PHASES.map(|phase| (phase.as_str().into(), u64::from(phase == status.phase)));
    sheet.gauges("trusswatch_phase", "1 for the phase that it is in.", "phase", phases)?;
    if let Some(step) = status.step {
        sheet.gauge("trusswatch_step", "The latest step diagnosed.", step.0)?;
    }
    let help = "From the latest sample's publication to its diagnosis.";
    sheet.seconds("trusswatch_lag", help, status.lag_ms.map(seconds_of_ms))?;
    let help = "Since the latest sample's publication, when the status was published.";
    sheet.seconds("trusswatch_sample_age", help, status.sample_age_ms.map(seconds_of_ms))?;
    let help = "Samples that wait to be diagnosed.";
    sheet.gauge("trusswatch_samples_queued", help, status.queued_samples)?;
    let help = "Peers' queries that wait for their step.";
    sheet.gauge("trusswatch_questions_waiting", help, status.waiting_questions)?;
    let help = "Transitions of verdicts, of all processes on this journal.";
    sheet.counter("trusswatch_transitions", help, status.next_sequence.saturating_sub(1))
}

fn write_components(components: &[ComponentReport], sheet: &mut Sheet<'_>) -> fmt::Result {
    let number = |state: FaultState| {
        let count = components.iter().filter(|component| component.state == state).count();
        (Cow::from(state.as_str()), count as u64)
    };
    let help = "Components in each state; latched and acknowledged ones are faulty, of unknown ones nothing is known.";
    sheet.gauges("trusswatch_components", help, "state", STATES.map(number))?;
    let faulty = components.iter().map(|component| {
        (component.component.to_string().into(), u64::from(component.state.is_fault()))
    });
    let help = "1 for a component that is considered faulty.";
    sheet.gauges("trusswatch_component_faulty", help, "component", faulty)?;
    let acknowledged = components.iter().map(|component| {
        let is_acknowledged = component.state == FaultState::Acknowledged;
        (component.component.to_string().into(), u64::from(is_acknowledged))
    });
    let help = "1 for a component whose fault an operator has acknowledged.";
    sheet.gauges("trusswatch_component_acknowledged", help, "component", acknowledged)
}

fn write_margins(margins: &[Margins], sheet: &mut Sheet<'_>) -> fmt::Result {
    let shares = margins.iter().flat_map(|of_component| {
        of_component.shares().into_iter().filter_map(|(test, share)| {
            let share = share.filter(|share| share.is_finite())?;
            Some(([of_component.component.to_string(), test.to_owned()], share))
        })
    });
    let help = "Statistic of a test as a share of its threshold, with the sign of the deviation; a fault is found at 1 and -1.";
    sheet.gauges_of_two("trusswatch_limit_ratio", help, ["component", "test"], shares)
}

fn write_set_aside(
    status: &ModuleStatus,
    components: &[ComponentReport],
    sheet: &mut Sheet<'_>,
) -> fmt::Result {
    let help = "Components whose alarm is shelved or suppressed.";
    sheet.gauge("trusswatch_components_set_aside", help, status.shelved)?;
    let help = "1 while the alarms of all components are suppressed, for the module is maintained.";
    let is_suppressed = u64::from(status.suppressed.is_some());
    sheet.gauge("trusswatch_module_suppressed", help, is_suppressed)?;
    let name = "trusswatch_component_set_aside";
    let each = components.iter().flat_map(|component| {
        HOW.map(|how| {
            let is_aside = component.aside.iter().any(|aside| aside.how == how);
            ([component.component.to_string(), how.to_owned()], u64::from(is_aside))
        })
    });
    let help = "1 for a component whose alarm is shelved or suppressed, by `how`.";
    sheet.gauges_of_two(name, help, ["component", "how"], each)?;
    let ends = components.iter().flat_map(|component| {
        component.aside.iter().map(|aside| {
            let labels = [component.component.to_string(), aside.how.to_owned()];
            (labels, seconds_of_ns(aside.until_unix_ns))
        })
    });
    let help = "End of the shelving or suppression of the alarm.";
    let name = "trusswatch_component_set_aside_end_timestamp";
    sheet.seconds_of_two(name, help, ["component", "how"], ends)
}

fn write_identifications(report: &IdentificationReport, sheet: &mut Sheet<'_>) -> fmt::Result {
    let kinds = report
        .kinds
        .iter()
        .map(|known| ([known.component.to_string(), known.kind.to_string()], known.probability));
    let help = "How probable it is that the fault of a component is of this kind.";
    let labels = ["component", "kind"];
    sheet.gauges_of_two("trusswatch_fault_kind_probability", help, labels, kinds)?;
    let help = "Times that a fault was identified, anew or for the first time.";
    sheet.counter("trusswatch_identifications", help, report.done)?;
    let help = "Time that identifying faults took.";
    sheet.counted_seconds("trusswatch_identification", help, report.took.as_secs_f64())?;
    let help = "Identifications published: the first of a fault, and those that differ materially.";
    sheet.counter("trusswatch_identifications_published", help, report.published)?;
    let missed = [("turned_away", report.turned_away), ("failed", report.failed)];
    let help = "Times that a fault was not identified, by reason.";
    sheet.counters("trusswatch_identifications_missed", help, "reason", missed)
}

fn write_counters(status: &ModuleStatus, sheet: &mut Sheet<'_>) -> fmt::Result {
    let ModuleStatus { intake, diagnosis, inquiries, publisher, .. } = status;
    let parts =
        [intake.metrics(), diagnosis.metrics(), inquiries.metrics(), publisher.metrics()].concat();
    for metric in parts.iter().filter(|metric| metric.label.is_none()) {
        sheet.counter(metric.name, metric.help, metric.count)?;
    }
    for (name, help, label) in LABELLED {
        let of = parts.iter().filter(|metric| metric.name == name);
        let counts = of.filter_map(|metric| Some((metric.label?, metric.count)));
        sheet.counters(name, help, label, counts)?;
    }
    Ok(())
}

fn write_journal(journal: &JournalStatus, sheet: &mut Sheet<'_>) -> fmt::Result {
    let help = "1 if faults outlive the process.";
    let kept = u64::from(journal.directory.is_some());
    sheet.gauge("trusswatch_journal_kept", help, kept)?;
    let failing = u64::from(journal.problem.is_some());
    sheet.gauge("trusswatch_journal_failing", "1 if it cannot be written at present.", failing)?;
    sheet.bytes("trusswatch_journal_size", "Size of the journal.", journal.bytes)?;
    let help = "Records that wait to be written.";
    sheet.gauge("trusswatch_journal_records_unsaved", help, journal.unsaved)?;
    let help = "Records dropped because too many were waiting.";
    sheet.counter("trusswatch_journal_records_lost", help, journal.lost)?;
    let help = "Damaged records found at the start and skipped.";
    sheet.counter("trusswatch_journal_records_damaged", help, journal.damaged)
}

fn write_peers(peers: &[PeerStatus], sheet: &mut Sheet<'_>) -> fmt::Result {
    let present =
        peers.iter().map(|peer| (Cow::from(peer.module.as_str()), u64::from(peer.present)));
    sheet.gauges("trusswatch_peer_present", "1 for a peer that is present.", "peer", present)?;
    let outcomes = peers.iter().flat_map(|peer| {
        [
            ("answered", peer.answered),
            ("refused", peer.refused),
            ("timed_out", peer.timed_out),
            ("absent", peer.absent),
            ("malformed", peer.malformed),
        ]
        .map(|(outcome, count)| ([peer.module.as_str(), outcome], count))
    });
    let help = "Queries to each peer, by outcome.";
    sheet.counters_of_two("trusswatch_peer_questions", help, ["peer", "outcome"], outcomes)?;
    let disputed = peers.iter().map(|peer| (peer.module.as_str(), peer.disputed));
    let help = "Explained changes whose explanation this peer did not stand by.";
    sheet.counters("trusswatch_peer_verdicts_disputed", help, "peer", disputed)
}

pub(super) fn seconds_of_ms(time_ms: f64) -> f64 {
    time_ms / 1e3
}

/// To the microsecond, which is what a double has left of the years since 1970.
#[expect(clippy::cast_precision_loss, reason = "a display value")]
pub(super) fn seconds_of_ns(time_ns: u64) -> f64 {
    (time_ns / 1000) as f64 / 1e6
}
