//! What a campaign's records come to: the paper's table, exact isolation, delays, false alarms.

mod delays;
mod interval;
mod paper_table;

use std::collections::BTreeMap;

use names::fault::FaultKind;
use serde::Serialize;

use crate::closest::Closest;
use crate::record::{Conversation, NominalRecord, ScenarioRecord};

pub use delays::Delays;
pub use interval::{Interval95, share_interval};
pub use paper_table::{PAPER_TABLE, PaperTable, PaperTableIntervals};

/// Zero outputs of a gage whose healthy reading exceeds its noise this many times must be found.
pub const READABLE: f64 = 10.0;

/// What a campaign came to. Shares are between 0 and 1, intervals cover 95 %.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Runs with a fault.
    pub scenarios: u64,
    /// Runs without a fault.
    pub nominal_runs: u64,
    /// Nominal runs in which anything was committed.
    pub false_alarm_runs: u64,
    /// Interval of the share of nominal runs with a false alarm (Clopper and Pearson); its upper end
    /// is the bound.
    pub false_alarm_runs_95: Interval95,
    /// How near any nominal run came to a change.
    pub closest: Option<Closest>,
    /// Shares of samples, any flag counting (Table 1 of the paper).
    pub paper_table: PaperTable,
    /// Their intervals, scenarios resampled with replacement.
    pub paper_table_95: PaperTableIntervals,
    /// Share of samples that are flagged rightly.
    pub accuracy: f64,
    /// Scenarios in which exactly the faulty component was named, and nothing before the fault.
    pub exact_isolation: ExactIsolation,
    /// Scenarios in which a healthy component was named.
    pub wrong_component_runs: u64,
    /// Scenarios in which the faulty component was not named.
    pub missed_runs: u64,
    /// Scenarios in which anything was committed before the fault.
    pub early_runs: u64,
    /// From the fault to the change of the faulty component \[ms\].
    pub delay_ms: BTreeMap<FaultKind, Delays>,
    /// From the fault to the verdict on the faulty component \[ms\].
    pub verdict_delay_ms: BTreeMap<FaultKind, Delays>,
    /// The same over all kinds \[ms\].
    pub delay_ms_overall: Delays,
    /// What came of each kind of fault.
    pub kinds: BTreeMap<FaultKind, KindSummary>,
    /// Zero outputs of gages whose healthy reading exceeded its noise ten times.
    pub readable_zero_outputs: Found,
    /// What the modules exchanged, summed over the scenarios.
    pub conversation: Conversation,
    /// Scenarios in which a peer was asked.
    pub scenarios_with_questions: u64,
    /// Numbers of the scenarios that are not exact.
    pub not_exact: Vec<u64>,
}

/// Shares of exactly isolated scenarios.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExactIsolation {
    /// Of all scenarios.
    pub overall: f64,
    /// Its interval (Clopper and Pearson).
    pub overall_95: Interval95,
    /// Of the scenarios with this kind of fault.
    pub by_kind: BTreeMap<FaultKind, f64>,
}

/// What came of the scenarios with one kind of fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KindSummary {
    /// Scenarios.
    pub scenarios: u64,
    /// Anything was committed once the fault had begun.
    pub detected: u64,
    /// Exactly the faulty component was named, and nothing before the fault.
    pub exact: u64,
    /// Interval of the share of exact ones (Clopper and Pearson).
    pub exact_95: Interval95,
    /// A healthy component was named.
    pub wrong: u64,
    /// The faulty component was not named.
    pub missed: u64,
    /// Anything was committed before the fault.
    pub early: u64,
}

/// How many of them were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Found {
    /// All.
    pub all: u64,
    /// Found.
    pub found: u64,
}

impl Summary {
    /// Sums up records; their order does not matter. Steps last `step_s`.
    #[must_use]
    pub fn of(scenarios: &[ScenarioRecord], nominal: &[NominalRecord], step_s: f64) -> Self {
        let mut scenarios: Vec<&ScenarioRecord> = scenarios.iter().collect();
        scenarios.sort_by_key(|record| record.number);
        let count =
            |of: &dyn Fn(&ScenarioRecord) -> bool| number(scenarios.iter().filter(|r| of(r)));
        let false_alarm_runs = number(nominal.iter().filter(|record| record.is_false_alarm()));
        let exact = count(&ScenarioRecord::is_exact);
        let kinds = of_kinds(&scenarios);
        let (paper_table, paper_table_95) = paper_table::of(&scenarios);
        Self {
            scenarios: scenarios.len() as u64,
            nominal_runs: nominal.len() as u64,
            false_alarm_runs,
            false_alarm_runs_95: share_interval(false_alarm_runs, nominal.len() as u64),
            closest: closest(nominal),
            accuracy: paper_table.accuracy(),
            paper_table,
            paper_table_95,
            exact_isolation: ExactIsolation {
                overall: share(exact, scenarios.len() as u64),
                overall_95: share_interval(exact, scenarios.len() as u64),
                by_kind: kinds
                    .iter()
                    .map(|(&kind, k)| (kind, share(k.exact, k.scenarios)))
                    .collect(),
            },
            wrong_component_runs: count(&|record| record.wrong().next().is_some()),
            missed_runs: count(&|record| record.named().is_none()),
            early_runs: count(&ScenarioRecord::is_false_alarm),
            delay_ms: delays::by_kind(&scenarios, step_s, ScenarioRecord::detection_delay),
            verdict_delay_ms: delays::by_kind(&scenarios, step_s, ScenarioRecord::verdict_delay),
            delay_ms_overall: Delays::of(
                scenarios.iter().filter_map(|record| record.detection_delay()),
                step_s,
            ),
            kinds,
            readable_zero_outputs: readable_zero_outputs(&scenarios),
            conversation: conversation(&scenarios),
            scenarios_with_questions: count(&|record| record.conversation.questions > 0),
            not_exact: (scenarios.iter().filter(|record| !record.is_exact()))
                .map(|record| record.number)
                .collect(),
        }
    }
}

fn number<T>(items: impl Iterator<Item = T>) -> u64 {
    items.count() as u64
}

/// 0 of nothing.
fn share(part: u64, all: u64) -> f64 {
    if all == 0 { 0.0 } else { part as f64 / all as f64 }
}

fn of_kinds(scenarios: &[&ScenarioRecord]) -> BTreeMap<FaultKind, KindSummary> {
    let mut kinds: BTreeMap<FaultKind, Vec<&ScenarioRecord>> = BTreeMap::new();
    for record in scenarios {
        kinds.entry(record.kind()).or_default().push(record);
    }
    kinds.into_iter().map(|(kind, records)| (kind, of_kind(&records))).collect()
}

fn of_kind(records: &[&ScenarioRecord]) -> KindSummary {
    let count = |of: &dyn Fn(&ScenarioRecord) -> bool| number(records.iter().filter(|r| of(r)));
    let exact = count(&ScenarioRecord::is_exact);
    KindSummary {
        scenarios: records.len() as u64,
        detected: count(&ScenarioRecord::is_detected),
        exact,
        exact_95: share_interval(exact, records.len() as u64),
        wrong: count(&|record| record.wrong().next().is_some()),
        missed: count(&|record| record.named().is_none()),
        early: count(&ScenarioRecord::is_false_alarm),
    }
}

fn readable_zero_outputs(scenarios: &[&ScenarioRecord]) -> Found {
    let readable = scenarios.iter().filter(|record| {
        record.kind() == FaultKind::ZeroOutput
            && record.reading_over_noise.is_some_and(|ratio| ratio > READABLE)
    });
    readable.fold(Found::default(), |found, record| Found {
        all: found.all + 1,
        found: found.found + u64::from(record.named().is_some()),
    })
}

fn conversation(scenarios: &[&ScenarioRecord]) -> Conversation {
    scenarios.iter().fold(Conversation::default(), |sum, record| {
        let Conversation { changes, questions, explained, explained_by_peer } = record.conversation;
        Conversation {
            changes: sum.changes + changes,
            questions: sum.questions + questions,
            explained: sum.explained + explained,
            explained_by_peer: sum.explained_by_peer + explained_by_peer,
        }
    })
}

/// The nearest that any run came to a change; of runs that came equally near, the first.
fn closest(nominal: &[NominalRecord]) -> Option<Closest> {
    let mut nominal: Vec<&NominalRecord> = nominal.iter().collect();
    nominal.sort_by_key(|record| std::cmp::Reverse(record.number));
    let closest = nominal.into_iter().filter_map(|record| record.closest.as_ref());
    closest.max_by(|a, b| a.ratio.total_cmp(&b.ratio)).cloned()
}
