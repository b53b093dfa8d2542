//! How the outcome is printed: one line of JSON a row, one line of text a row, or a summary.

use std::io::{self, Write};

use diagnosis::detector::ChannelReading;
use serde::{Serialize, Serializer};

use super::arguments::Arguments;
use super::channels::DetectionPlan;
use super::tally::{ChannelTally, TableTally};
use crate::output;
use crate::table::{TextTable, table, terminal_width};

/// Writes the outcome.
pub(super) struct DetectionReport<'a, W> {
    pub(super) arguments: &'a Arguments,
    pub(super) plan: &'a DetectionPlan,
    pub(super) channels: &'a [String],
    pub(super) out: W,
}

impl<W: Write> DetectionReport<'_, W> {
    /// Prints one row.
    pub(super) fn row(
        &mut self,
        row: u64,
        usable: bool,
        readings: &[ChannelReading],
    ) -> io::Result<()> {
        match (self.arguments.json, self.arguments.all) {
            (true, _) => self.json(row, readings),
            (false, true) => self.text(row, usable, readings),
            (false, false) => Ok(()),
        }
    }

    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    /// Prints the summary.
    pub(super) fn end(&mut self, name: &str, tally: &TableTally) -> io::Result<()> {
        if !self.arguments.json && !self.arguments.all {
            writeln!(self.out, "{}", self.heading(name, tally))?;
            writeln!(self.out, "{}", self.table(tally).text(terminal_width()))?;
            let leavings: u64 = tally.channels.iter().map(|channel| channel.leavings).sum();
            if leavings > 0 {
                writeln!(
                    self.out,
                    "\nwhat left the interval again, also of the warm-up, not counted as changes: {leavings}"
                )?;
            }
        }
        self.out.flush()
    }

    fn json(&mut self, index: u64, readings: &[ChannelReading]) -> io::Result<()> {
        let channels = ReadingsByName { names: self.channels, readings };
        write!(self.out, "{}", output::line(&JsonRow { index, channels })?)
    }

    fn text(&mut self, row: u64, usable: bool, readings: &[ChannelReading]) -> io::Result<()> {
        if row == 0 {
            write!(self.out, "{:>10}", "row")?;
            for channel in self.channels {
                write!(self.out, "  {channel:>14}")?;
            }
            writeln!(self.out)?;
        }
        write!(self.out, "{row:>10}")?;
        for (channel, reading) in self.channels.iter().zip(readings) {
            let width = channel.chars().count().max(14);
            let text = match reading.divergence {
                Some(divergence) if reading.change && reading.leaving => {
                    format!("{divergence:.6e} ~")
                }
                Some(divergence) if reading.change => format!("{divergence:.6e} !"),
                Some(divergence) => format!("{divergence:.6e}  "),
                None if usable => "-  ".to_owned(),
                None => "bad  ".to_owned(),
            };
            write!(self.out, "  {text:>width$}")?;
        }
        writeln!(self.out)
    }

    fn heading(&self, name: &str, tally: &TableTally) -> String {
        let (rows, channels, words) = (tally.rows, self.channels.len(), &self.plan.words);
        format!("{name}: {rows} rows, {channels} channels; rows are counted from 0\n{words}")
    }

    fn table(&self, tally: &TableTally) -> TextTable {
        let mut table =
            table(&["channel", "rows with D", "largest D", "at row", "changes", "at rows"]);
        for (name, channel) in self.channels.iter().zip(&tally.channels) {
            table.add_row(self.summary(name, channel));
        }
        table.align_right(1..5);
        table
    }

    fn summary(&self, name: &str, channel: &ChannelTally) -> [String; 6] {
        let dash = || "-".to_owned();
        let (largest, at) = channel.largest.map_or_else(
            || (dash(), dash()),
            |(divergence, row)| (format!("{divergence:.6}"), row.to_string()),
        );
        let has_threshold = self.plan.has_threshold();
        let changes = if has_threshold { channel.changes.to_string() } else { dash() };
        [name.to_owned(), channel.defined.to_string(), largest, at, changes, rows_text(channel)]
    }
}

fn rows_text(channel: &ChannelTally) -> String {
    let mut rows: Vec<String> = channel.first_changes.iter().map(u64::to_string).collect();
    if channel.changes > rows.len() as u64 {
        rows.push("…".to_owned());
    }
    if rows.is_empty() { "-".to_owned() } else { rows.join(" ") }
}

#[derive(Serialize)]
struct JsonRow<'a> {
    index: u64,
    channels: ReadingsByName<'a>,
}

/// The channels in the order of their columns.
struct ReadingsByName<'a> {
    names: &'a [String],
    readings: &'a [ChannelReading],
}

impl Serialize for ReadingsByName<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.names.iter().zip(self.readings))
    }
}
