//! What came of many cases, by situation.

use std::collections::BTreeMap;

use serde::Serialize;

use super::draw::Situation;
use super::run::{CaseRecord, Standing};
use crate::summary::{Interval95, share_interval};

/// What came of the cases of one situation.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct SituationTally {
    /// How many there were.
    pub cases: u64,
    /// Faults, by how they stand at the end.
    pub faults: BTreeMap<Standing, u64>,
    /// Cases in which a healthy component was declared faulty.
    pub healthy_named: u64,
    /// Hours of the plant's time.
    pub hours: f64,
    /// Questions put to peers.
    pub questions: u64,
}

impl SituationTally {
    /// Counts cases of whatever situation.
    #[must_use]
    pub fn of(records: &[CaseRecord], step_s: f64) -> Self {
        let mut all = Self::default();
        records.iter().for_each(|record| all.count(record, step_s));
        all
    }

    fn count(&mut self, record: &CaseRecord, step_s: f64) {
        self.cases += 1;
        self.healthy_named += u64::from(!record.healthy_named.is_empty());
        self.hours += record.steps as f64 * step_s / 3600.0;
        self.questions += record.questions;
        for (_, _, standing, _) in &record.faulty {
            *self.faults.entry(*standing).or_default() += 1;
        }
    }

    /// Faults that stand so at the end.
    #[must_use]
    pub fn faults_that_are(&self, standing: Standing) -> u64 {
        self.faults.get(&standing).copied().unwrap_or(0)
    }

    /// Faults in all.
    #[must_use]
    pub fn all_faults(&self) -> u64 {
        self.faults.values().sum()
    }

    /// Interval of the share of faults that stand so at the end (Clopper and Pearson).
    #[must_use]
    pub fn share_95(&self, standing: Standing) -> Interval95 {
        share_interval(self.faults_that_are(standing), self.all_faults())
    }

    /// Interval of the share of cases in which a healthy component was declared faulty.
    #[must_use]
    pub fn healthy_named_95(&self) -> Interval95 {
        share_interval(self.healthy_named, self.cases)
    }
}

/// Counts cases by situation.
#[must_use]
pub fn tally(records: &[CaseRecord], step_s: f64) -> BTreeMap<Situation, SituationTally> {
    let mut tallies = BTreeMap::<_, SituationTally>::new();
    for record in records {
        tallies.entry(record.situation).or_default().count(record, step_s);
    }
    tallies
}
