//! Tables of several rates on one step: a value is held until its table's next row is due, and never over a gap.

use crate::failure::Failure;
use crate::learn;
use tables::{CsvRows, TableFlags};

use super::map::{Source, TableMap};

/// How far apart clocks may be that are brought together by a common column \[s\].
const FARTHEST_S: f64 = 600.0;
/// Blocks in which the offset is looked for first.
const BLOCKS: usize = 4096;
/// A common column has at least this correlation.
const LEAST_CORRELATION: f64 = 0.7;

/// A table, read whole.
pub(super) struct LoggerTable {
    pub(super) name: String,
    pub(super) step_s: f64,
    /// When its first row was taken, against the first table's \[s\].
    pub(super) begins_s: f64,
    /// When that was \[s since 1970\], and whether the table says its time zone.
    pub(super) began_unix_s: Option<(f64, bool)>,
    /// By column; NaN where a row or a value is missing.
    pub(super) columns: Vec<Vec<f64>>,
}

impl LoggerTable {
    /// Reads these columns of a table.
    pub(super) fn read(
        mut rows: CsvRows,
        (flags, map): (&TableFlags, &TableMap),
        columns: usize,
    ) -> Result<Self, Failure> {
        let name = rows.name().to_owned();
        let mut values = vec![Vec::new(); columns];
        let mut first = None;
        let mut next = 0;
        while let Some(row) = rows.next_row()? {
            let usable = row.problem.is_none();
            if let Some(problem) = row.problem.filter(|_| !flags.skip_bad) {
                return Err(Failure::input(format!("{name}, {problem}")));
            }
            let place = if usable { row.step - *first.get_or_insert(row.step) } else { next };
            learn::check_gap(&name, place.saturating_sub(next))?;
            for (column, values) in values.iter_mut().enumerate() {
                values.resize(place as usize, f64::NAN);
                values.push(if usable { row.values[column] } else { f64::NAN });
            }
            next = place + 1;
        }
        let step_s = learn::step_s(&rows, map.rate_hz)?;
        let (begins_s, began_unix_s) = (map.offset_s.unwrap_or(0.0), rows.began_unix_s());
        Ok(Self { name, step_s, begins_s, began_unix_s, columns: values })
    }

    fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// How much later its first row was taken than another table's, by the dates of both \[s\]; 0 if one of them has none.
    ///
    /// # Errors
    /// Only one of them says its time zone.
    pub(super) fn dated_after(&self, first: &Self) -> Result<f64, Failure> {
        let Some(((own, zoned), (other, of_first))) = self.began_unix_s.zip(first.began_unix_s)
        else {
            return Ok(0.0);
        };
        if zoned == of_first {
            return Ok(own - other);
        }
        let (with, without) = if zoned { (self, first) } else { (first, self) };
        Err(Failure::input(format!(
            "{} says the time zone of its times and {} does not; give the second table's `offset_s`, or a `common` column",
            with.name, without.name
        )))
    }

    /// When its last row counts no more \[s\].
    pub(super) fn ends_s(&self) -> f64 {
        self.begins_s + self.rows() as f64 * self.step_s
    }

    /// The value of a column at a time; NaN before the first row, in a gap and after the last.
    pub(super) fn at(&self, column: usize, time_s: f64) -> f64 {
        // A row at this very instant counts, whatever the rounding.
        let latest = ((time_s - self.begins_s) / self.step_s + 1e-6).floor();
        if latest < 0.0 {
            return f64::NAN;
        }
        self.columns[column].get(latest as usize).copied().unwrap_or(f64::NAN)
    }
}

/// How much later another clock's rows were taken than they would be if both began together \[s\], and the correlation
/// of the common column there. `step_s` is how finely it is told.
///
/// # Errors
/// In words, why it cannot be told.
pub(super) fn offset_s(
    (one, own): (&LoggerTable, usize),
    (other, common): (&LoggerTable, usize),
    step_s: f64,
) -> Result<(f64, f64), String> {
    let samples = |table: &LoggerTable, column: usize| -> Vec<f64> {
        let count = (table.rows() as f64 * table.step_s / step_s).floor() as usize;
        // Held values would be late by half a row; for this alone they are interpolated.
        let between = |k: usize| {
            let place = k as f64 * step_s / table.step_s;
            let row = |row: f64| table.columns[column].get(row as usize).copied();
            let (before, share) = (row(place.floor()).unwrap_or(f64::NAN), place.fract());
            before + share * (row(place.floor() + 1.0).unwrap_or(before) - before)
        };
        (0..count).map(between).collect()
    };
    let (one, other) = (samples(one, own), samples(other, common));
    let longest = one.len().max(other.len());
    let mut width = longest.div_ceil(BLOCKS).max(1);
    let farthest = (FARTHEST_S / step_s) as i64;
    let mut range = -farthest..=farthest;
    loop {
        let (a, b) = (blocks(&one, width), blocks(&other, width));
        let reach = |lag: i64| lag.div_euclid(width as i64);
        let lags = reach(*range.start())..=reach(*range.end()) + 1;
        let found = lags.filter_map(|lag| Some((lag, correlation(&a, &b, lag)?)));
        let best = found.max_by(|(_, a), (_, b)| a.total_cmp(b));
        let (lag, correlation) =
            best.ok_or("the tables hardly overlap, or the column is constant")?;
        if width == 1 {
            return Ok((lag as f64 * step_s, correlation));
        }
        let (around, margin) = (lag * width as i64, 2 * width as i64);
        range = around - margin..=around + margin;
        width = width.div_ceil(8);
    }
}

/// # Errors
/// It is too small to be the same quantity.
pub(super) fn check_correlation(correlation: f64) -> Result<(), String> {
    if correlation >= LEAST_CORRELATION {
        return Ok(());
    }
    Err(format!(
        "its correlation is at most {correlation:.2}, below {LEAST_CORRELATION}; give `offset_s`, or a `common` column \
         of the same quantity"
    ))
}

/// Means of blocks of so many, without what is missing.
fn blocks(samples: &[f64], width: usize) -> Vec<f64> {
    let mean = |block: &[f64]| {
        let (sum, count) = block
            .iter()
            .filter(|x| x.is_finite())
            .fold((0.0, 0.0), |(sum, count), x| (sum + x, count + 1.0));
        sum / count
    };
    samples.chunks(width).map(mean).collect()
}

/// Of one series with another that began so much later; `None` if too few overlap.
fn correlation(one: &[f64], other: &[f64], lag: i64) -> Option<f64> {
    let (skip, begin) = (lag.max(0) as usize, (-lag).max(0) as usize);
    let pairs = one.get(skip..)?.iter().zip(other.get(begin..)?);
    let [mut n, mut a, mut b, mut aa, mut bb, mut ab] = [0.0_f64; 6];
    for (x, y) in pairs.filter(|(x, y)| x.is_finite() && y.is_finite()) {
        n += 1.0;
        a += x;
        b += y;
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    let spread = (aa - a * a / n) * (bb - b * b / n);
    let enough = n >= 0.25 * one.len().min(other.len()) as f64 && spread > 0.0;
    enough.then(|| (ab - a * b / n) / spread.sqrt())
}

/// The value of each source at a time.
pub(super) fn sample(tables: &[LoggerTable], places: &[(usize, &Source)], time_s: f64) -> Vec<f64> {
    let value = |(column, source): &(usize, &Source)| {
        source.value(tables[source.table].at(*column, time_s))
    };
    places.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(begins_s: f64, step_s: f64, rows: usize, of: impl Fn(f64) -> f64) -> LoggerTable {
        let column = (0..rows).map(|k| of(k as f64 * step_s)).collect();
        LoggerTable {
            name: "t".into(),
            step_s,
            begins_s,
            began_unix_s: None,
            columns: vec![column],
        }
    }

    #[test]
    fn a_value_is_held_until_the_next_row_is_due_and_never_over_a_gap() {
        let mut slow = table(1.0, 0.5, 4, |time| time);
        slow.columns[0][2] = f64::NAN;
        let at = |time_s| slow.at(0, time_s);
        assert_eq!([1.0, 1.4999, 1.5, 2.74].map(at), [0.0, 0.0, 0.5, 1.5]);
        for missing in [0.9, 2.0, 2.4, 3.5] {
            assert!(at(missing).is_nan(), "{missing}");
        }
    }

    #[test]
    fn clocks_are_brought_together_by_what_both_measure() {
        let truth =
            |time: f64| (time / 7.0).sin() + (time / 2.3).cos() + (time * time / 900.0).sin();
        for offset in [0.0, 3.37, -41.02] {
            let one = table(0.0, 0.01, 20_000, truth);
            let other = table(0.0, 0.02, 9000, |time| 5.0 + 2.0 * truth(time + offset));
            let (found, correlation) = offset_s((&one, 0), (&other, 0), 0.01).unwrap();
            assert!((found - offset).abs() <= 0.02, "{offset}: {found}");
            assert!(correlation > 0.99);
        }
        let noise = table(0.0, 0.01, 20_000, |time| (time * 1e4).sin() * (time * 7e3).cos());
        let other = table(0.0, 0.01, 20_000, truth);
        let (_, correlation) = offset_s((&noise, 0), (&other, 0), 0.01).unwrap();
        assert!(check_correlation(correlation).unwrap_err().contains("`offset_s`"));
    }
}
