//! What came of many histories.

use std::collections::BTreeMap;

use serde::Serialize;

use super::pattern::Pattern;
use super::record::HistoryRecord;
use crate::summary::{Found, Interval95, share_interval};

/// What came of the histories of a pattern, or of all.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct HistoryTally {
    /// How many there were.
    pub histories: u64,
    /// Histories in which a healthy component was named.
    pub healthy_named: u64,
    /// First faults.
    pub first_faults: Found,
    /// Faults of other components after the first.
    pub later_faults: Found,
    /// Histories with changes that could not be judged in the end.
    pub unconfirmed: u64,
}

impl HistoryTally {
    /// Counts another one.
    pub fn count(&mut self, record: &HistoryRecord) {
        self.histories += 1;
        self.healthy_named += u64::from(record.healthy().next().is_some());
        self.unconfirmed += u64::from(record.unconfirmed > 0);
        for (place, (_, named)) in record.faulty.iter().enumerate() {
            let found = if place == 0 { &mut self.first_faults } else { &mut self.later_faults };
            found.all += 1;
            found.found += u64::from(*named);
        }
    }

    /// The tallies of each pattern.
    #[must_use]
    pub fn by_pattern(records: &[HistoryRecord]) -> BTreeMap<Pattern, Self> {
        let mut tallies = BTreeMap::<_, Self>::new();
        for record in records {
            tallies.entry(record.pattern).or_default().count(record);
        }
        tallies
    }

    /// The tally of all.
    #[must_use]
    pub fn of(records: &[HistoryRecord]) -> Self {
        let mut tally = Self::default();
        records.iter().for_each(|record| tally.count(record));
        tally
    }

    /// Interval of the share of histories in which a healthy component is named (Clopper and Pearson).
    #[must_use]
    pub fn healthy_named_95(&self) -> Interval95 {
        share_interval(self.healthy_named, self.histories)
    }
}
