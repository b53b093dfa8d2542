//! What came of a table, in constant memory.

use diagnosis::detector::ChannelReading;
use diagnosis::divergence::Violation;

use super::channels::DetectionPlan;
use crate::failure::Failure;

/// How many changes are listed by their row.
const CHANGES_LISTED: usize = 12;

/// What came of one channel.
#[derive(Debug, Clone, Default)]
pub(super) struct ChannelTally {
    /// Rows with a divergence.
    pub(super) defined: u64,
    /// The largest divergence and its row, but for changes that leave the interval.
    pub(super) largest: Option<(f64, u64)>,
    /// How often the divergence rose to the threshold, but for changes that leave the interval.
    pub(super) changes: u64,
    /// The rows of the first changes.
    pub(super) first_changes: Vec<u64>,
    /// How often it did so because an earlier change left the interval.
    pub(super) leavings: u64,
    changed: bool,
    counted: bool,
    /// How often the channel was restarted.
    pub(super) restarts: u64,
    /// The reason and the row of the first restart.
    pub(super) first_restart: Option<(Violation, u64)>,
}

impl ChannelTally {
    fn take(&mut self, row: u64, reading: &ChannelReading) {
        if let Some(divergence) = reading.divergence {
            self.defined += 1;
            if !reading.leaving && self.largest.is_none_or(|(largest, _)| divergence > largest) {
                self.largest = Some((divergence, row));
            }
        }
        self.leavings += u64::from(reading.change && reading.leaving && !self.changed);
        if reading.change && !reading.leaving && !(self.changed && self.counted) {
            self.changes += 1;
            if self.first_changes.len() < CHANGES_LISTED {
                self.first_changes.push(row);
            }
        }
        self.counted = reading.change && !reading.leaving;
        self.changed = reading.change;
        if let Some(violation) = reading.restarted {
            self.restarts += 1;
            self.first_restart.get_or_insert((violation, row));
        }
    }
}

/// What came of a table.
#[derive(Debug, Clone)]
pub(super) struct TableTally {
    /// Rows taken.
    pub(super) rows: u64,
    /// Rows that were bad.
    pub(super) bad_rows: u64,
    /// What came of each channel.
    pub(super) channels: Vec<ChannelTally>,
}

impl TableTally {
    pub(super) fn new(channels: usize) -> TableTally {
        TableTally { rows: 0, bad_rows: 0, channels: vec![ChannelTally::default(); channels] }
    }

    /// Takes the next row.
    pub(super) fn take(&mut self, usable: bool, readings: &[ChannelReading]) {
        for (channel, reading) in self.channels.iter_mut().zip(readings) {
            channel.take(self.rows, reading);
        }
        self.rows += 1;
        self.bad_rows += u64::from(!usable);
    }

    /// A run that judged nothing fails.
    ///
    /// # Errors
    /// No channel has a divergence.
    pub(super) fn check_judged(&self, name: &str, plan: &DetectionPlan) -> Result<(), Failure> {
        if self.channels.iter().any(|channel| channel.defined > 0) {
            return Ok(());
        }
        let (bad, all) = (self.bad_rows, self.rows);
        let least = plan.groups.iter().map(|group| group.settings.window + group.settings.lag + 1);
        Err(Failure::input(match least.min() {
            Some(least) if bad == 0 && all < least as u64 => {
                format!("{name}: nothing was judged: {all} rows are too few, use at least {least}")
            }
            _ if bad > 0 => format!("{name}: nothing was judged: {bad} of {all} rows were bad"),
            _ => format!("{name}: nothing was judged: no channel has enough values without a gap"),
        }))
    }

    /// Number of the row taken last, from 0.
    pub(super) fn last_row(&self) -> u64 {
        self.rows.saturating_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_counted_where_it_begins() {
        let mut tally = TableTally::new(1);
        for change in [false, true, true, false, true] {
            tally.take(true, &[ChannelReading { change, ..ChannelReading::default() }]);
        }
        assert_eq!(tally.channels[0].changes, 2);
        assert_eq!(tally.channels[0].first_changes, [1, 4]);
    }

    #[test]
    fn a_change_that_leaves_the_interval_is_told_apart() {
        let mut tally = TableTally::new(1);
        let rows = [(true, false), (false, false), (true, true), (true, true), (true, false)];
        for (row, (change, leaving)) in rows.into_iter().enumerate() {
            let divergence = Some(if leaving { 9.0 } else { row as f64 });
            let reading = ChannelReading { divergence, change, leaving, restarted: None };
            tally.take(true, &[reading]);
        }
        let channel = &tally.channels[0];
        assert_eq!((channel.changes, channel.leavings), (2, 1));
        assert_eq!((&channel.first_changes[..], channel.largest), (&[0, 4][..], Some((4.0, 4))));
    }
}
