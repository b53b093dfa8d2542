//! Summarises records: exact isolation, delays, false alarms, the paper's table.

use std::collections::BTreeMap;

use serde::Serialize;
use vocabulary::fault::FaultKind;

use super::paper_table::{self, PaperTable};
use super::record::{Closest, Conversation, ScenarioRow};
use crate::campaign::{Rows, grouped};
use crate::statistics::{Delays, Interval95, rate_interval, share_interval};

/// Zero outputs of a gage must be found if its healthy reading exceeds this multiple of its noise.
pub const READABLE: f64 = 10.0;

/// The results of a campaign. Shares are between 0 and 1, intervals cover 95 %.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScenarioSummary {
    /// Runs with a fault.
    pub all: Isolation,
    /// The same by kind of fault.
    pub kinds: BTreeMap<FaultKind, Isolation>,
    /// Runs without a fault.
    pub nominal: Nominal,
    /// Shares of samples of the runs with a fault, any flag counting (Table 1 of the paper).
    pub samples: PaperTable<f64>,
    /// Their intervals, runs resampled with replacement.
    pub samples_95: PaperTable<Interval95>,
    /// Share of correctly flagged samples among those from the end of the warm-up on: before, nothing can be flagged.
    pub watched_accuracy: f64,
    /// Zero outputs of gages whose healthy reading exceeded ten times their noise.
    pub readable_zero_outputs: FoundCount,
    /// The messages exchanged by modules, summed over the runs with a fault.
    pub conversation: Conversation,
    /// Runs with a fault in which a peer was queried.
    pub with_questions: u64,
    /// Numbers of the runs with a fault that are not exact.
    pub not_exact: Vec<u64>,
}

/// The results of runs with a fault.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Isolation {
    /// Runs.
    pub cases: u64,
    /// Runs in which a component was declared faulty after the fault had begun.
    pub detected: u64,
    /// Runs in which exactly the faulty component was named, and none before the fault.
    pub exact: u64,
    /// Interval of the share of exact ones (Clopper and Pearson).
    pub exact_95: Interval95,
    /// Runs in which a healthy component was named.
    pub wrong: u64,
    /// Runs in which the faulty component was not named.
    pub missed: u64,
    /// Runs in which a component was declared faulty before the fault.
    pub early: u64,
    /// From the fault to the change of the faulty component \[ms\].
    pub delay_ms: Delays,
    /// From the fault to the verdict on the faulty component \[ms\].
    pub verdict_delay_ms: Delays,
}

/// The results of runs without a fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Nominal {
    /// Runs.
    pub cases: u64,
    /// Runs in which a component was declared faulty.
    pub false_alarms: u64,
    /// Interval of their share (Clopper and Pearson); its upper end is the bound.
    pub false_alarms_95: Interval95,
    /// Time watched, from the end of each run's warm-up to its first alarm or its end \[h\].
    pub hours: f64,
    /// False alarms per hour watched, each run counting up to its first; 0 if none was watched.
    pub per_hour: f64,
    /// Its interval (Garwood), from 0 to infinity (`null`) if none was watched; the upper end is the bound.
    pub per_hour_95: Interval95,
    /// The largest ratio of divergence to threshold.
    pub closest: Option<Closest>,
}

/// The number of faults found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct FoundCount {
    /// All.
    pub all: u64,
    /// Found.
    pub found: u64,
}

impl FoundCount {
    /// Counts another one.
    pub(crate) fn count(&mut self, is_found: bool) {
        self.all += 1;
        self.found += u64::from(is_found);
    }
}

impl ScenarioSummary {
    /// Summarises rows. Steps last `step_s`; every channel is watched from step `watched_from` on.
    #[must_use]
    pub fn of(rows: &Rows<ScenarioRow>, step_s: f64, watched_from: u64) -> Self {
        let mut readable_zero_outputs = FoundCount::default();
        let mut not_exact = Vec::new();
        for (number, record) in rows {
            let Some(kind) = record.kind() else { continue };
            if !record.is_exact() {
                not_exact.push(*number);
            }
            let readable = record.reading_over_noise.is_some_and(|ratio| ratio > READABLE);
            if kind == FaultKind::ZeroOutput && readable {
                readable_zero_outputs.count(record.named().is_some());
            }
        }
        let scenarios: Vec<&ScenarioRow> =
            rows.values().filter(|row| row.kind().is_some()).collect();
        let kinds = grouped(scenarios.iter().copied(), ScenarioRow::kind);
        let kinds =
            kinds.iter().filter_map(|(kind, of)| Some(((*kind)?, Isolation::of(of, step_s))));
        let counts: Vec<_> = scenarios.iter().map(|record| record.samples()).collect();
        let (samples, samples_95) = paper_table::of(&counts);
        let steps = scenarios.iter().map(|record| record.steps).sum::<u64>();
        let warm_up =
            scenarios.iter().map(|record| record.steps.min(watched_from)).sum::<u64>() as f64;
        let watched = steps as f64 - warm_up;
        let right = samples.accuracy * steps as f64 - warm_up;
        Self {
            all: Isolation::of(&scenarios, step_s),
            kinds: kinds.collect(),
            nominal: Nominal::of(
                rows.values().filter(|row| row.kind().is_none()),
                step_s,
                watched_from,
            ),
            samples,
            samples_95,
            watched_accuracy: if watched > 0.0 { right / watched } else { 0.0 },
            readable_zero_outputs,
            conversation: conversation(&scenarios),
            with_questions: count(&scenarios, |record| record.conversation.questions > 0),
            not_exact,
        }
    }
}

fn count(records: &[&ScenarioRow], of: impl Fn(&ScenarioRow) -> bool) -> u64 {
    records.iter().filter(|record| of(record)).count() as u64
}

impl Isolation {
    fn of(records: &[&ScenarioRow], step_s: f64) -> Self {
        let cases = records.len() as u64;
        let exact = count(records, ScenarioRow::is_exact);
        let delays = |of: fn(&ScenarioRow) -> Option<u64>| {
            Delays::of(records.iter().filter_map(|record| of(record)), step_s)
        };
        Self {
            cases,
            detected: count(records, ScenarioRow::is_detected),
            exact,
            exact_95: share_interval(exact, cases),
            wrong: count(records, |record| record.wrong().next().is_some()),
            missed: count(records, |record| record.named().is_none()),
            early: count(records, ScenarioRow::is_false_alarm),
            delay_ms: delays(ScenarioRow::detection_delay),
            verdict_delay_ms: delays(ScenarioRow::verdict_delay),
        }
    }

    /// Share of exact runs; 0 without runs.
    #[must_use]
    pub fn exact_share(&self) -> f64 {
        self.exact as f64 / self.cases.max(1) as f64
    }
}

impl Nominal {
    fn of<'a>(
        records: impl Iterator<Item = &'a ScenarioRow>,
        step_s: f64,
        watched_from: u64,
    ) -> Self {
        let (mut cases, mut false_alarms, mut closest) = (0, 0, None::<&Closest>);
        let mut watched = 0;
        for record in records {
            cases += 1;
            false_alarms += u64::from(record.is_false_alarm());
            let first = record.diagnosed.iter().map(|diagnosed| diagnosed.decided.0).min();
            watched += first.unwrap_or(record.steps).saturating_sub(watched_from);
            // Of equal ratios, the first.
            let nearer = record.closest.as_ref();
            let nearer = nearer.filter(|new| closest.is_none_or(|old| new.ratio > old.ratio));
            closest = nearer.or(closest);
        }
        let hours = watched as f64 * step_s / 3600.0;
        let Interval95(low, high) = rate_interval(false_alarms);
        let (per_hour, per_hour_95) = if watched > 0 {
            (false_alarms as f64 / hours, Interval95(low / hours, high / hours))
        } else {
            (0.0, Interval95(0.0, f64::INFINITY))
        };
        let false_alarms_95 = share_interval(false_alarms, cases);
        let closest = closest.cloned();
        Self { cases, false_alarms, false_alarms_95, hours, per_hour, per_hour_95, closest }
    }
}

fn conversation(scenarios: &[&ScenarioRow]) -> Conversation {
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
