//! What came of a table, in constant memory.

use diagnosis::divergence::Violation;

use super::detector::Reading;

/// How many changes are listed by their row.
const CHANGES_LISTED: usize = 12;

/// What came of one channel.
#[derive(Debug, Clone, Default)]
pub(super) struct ChannelTally {
    defined: u64,
    largest: Option<(f64, u64)>,
    changes: u64,
    first_changes: Vec<u64>,
    changed: bool,
    restarts: u64,
    first_restart: Option<(Violation, u64)>,
}

impl ChannelTally {
    /// Rows with a divergence.
    pub(super) fn defined(&self) -> u64 {
        self.defined
    }

    /// The largest divergence and its row.
    pub(super) fn largest(&self) -> Option<(f64, u64)> {
        self.largest
    }

    /// How often the divergence rose to the threshold.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// The rows of the first changes.
    pub(super) fn first_changes(&self) -> &[u64] {
        &self.first_changes
    }

    /// How often the channel was restarted.
    pub(super) fn restarts(&self) -> u64 {
        self.restarts
    }

    /// The reason and the row of the first restart.
    pub(super) fn first_restart(&self) -> Option<(Violation, u64)> {
        self.first_restart
    }

    fn take(&mut self, row: u64, reading: &Reading) {
        if let Some(divergence) = reading.divergence {
            self.defined += 1;
            if self.largest.is_none_or(|(largest, _)| divergence > largest) {
                self.largest = Some((divergence, row));
            }
        }
        if reading.change && !self.changed {
            self.changes += 1;
            if self.first_changes.len() < CHANGES_LISTED {
                self.first_changes.push(row);
            }
        }
        self.changed = reading.change;
        if let Some(violation) = reading.restarted {
            self.restarts += 1;
            self.first_restart.get_or_insert((violation, row));
        }
    }
}

/// What came of a table.
#[derive(Debug, Clone)]
pub(super) struct Tally {
    rows: u64,
    bad_rows: u64,
    channels: Vec<ChannelTally>,
}

impl Tally {
    pub(super) fn new(channels: usize) -> Tally {
        Tally { rows: 0, bad_rows: 0, channels: vec![ChannelTally::default(); channels] }
    }

    /// Takes the next row.
    pub(super) fn take(&mut self, usable: bool, readings: &[Reading]) {
        for (channel, reading) in self.channels.iter_mut().zip(readings) {
            channel.take(self.rows, reading);
        }
        self.rows += 1;
        self.bad_rows += u64::from(!usable);
    }

    /// Rows taken.
    pub(super) fn rows(&self) -> u64 {
        self.rows
    }

    /// Number of the row taken last, from 0.
    pub(super) fn last_row(&self) -> u64 {
        self.rows.saturating_sub(1)
    }

    /// Rows that were bad.
    pub(super) fn bad_rows(&self) -> u64 {
        self.bad_rows
    }

    /// What came of each channel.
    pub(super) fn channels(&self) -> &[ChannelTally] {
        &self.channels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_counted_where_it_begins() {
        let mut tally = Tally::new(1);
        for change in [false, true, true, false, true] {
            tally.take(true, &[Reading { change, ..Reading::default() }]);
        }
        assert_eq!(tally.channels()[0].changes(), 2);
        assert_eq!(tally.channels()[0].first_changes(), [1, 4]);
    }
}
