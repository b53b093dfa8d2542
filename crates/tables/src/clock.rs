//! Which step a row is: by a column of steps, by one of times, or by counting.

use super::number::{DecimalMark, decoded, number};

/// Name of the column that numbers the steps.
pub(crate) const STEP: &str = "step";
/// Usual names of a column of times, without units and in small letters.
const TIMES: [&str; 19] = [
    "time",
    "t",
    "ts",
    "timestamp",
    "time stamp",
    "datetime",
    "date time",
    "date/time",
    "date_time",
    "elapsed",
    "elapsed time",
    "utc",
    "x_value",
    "zeit",
    "datum/zeit",
    "record",
    "index",
    "sample",
    "scan",
];
/// Up to here every whole number is a floating-point number.
const LARGEST_STEP: f64 = (1_u64 << 53) as f64;
/// Time differences that tell the usual one.
const RECENT: usize = 9;
/// A time difference of so many usual ones is a gap.
const GAP: f64 = 1.5;
/// A clock whose recent differences are all this close together shows every row its own time.
const STEADY: f64 = 1.25;
const DAY_S: f64 = 86_400.0;
/// 1970-01-01 as [`days`] counts.
const DAY_OF_1970: f64 = 719_469.0;
/// Numbers of seconds that are taken as counted since 1970: from 1980 to 2100.
const EPOCH_S: std::ops::Range<f64> = 315_532_800.0..4_102_444_800.0;

/// Why a row has no step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ClockError {
    /// The cell is bad.
    Cell(String),
    /// It is not after the row before.
    Order(String),
}

/// Counts the steps of rows.
#[derive(Debug, Clone, Default)]
pub(crate) struct Clock {
    /// Of the column that tells, if one does.
    pub(crate) place: Option<usize>,
    is_step: bool,
    /// Seconds of its unit, if its cells are numbers.
    unit_s: f64,
    first: Option<Moment>,
    last: Option<Moment>,
    /// The latest time differences, in no order.
    recent: Vec<f64>,
    taken: usize,
    /// Rows that have shown the latest time.
    shown: u64,
    /// Of a clock too coarse for its rows: its tick, and how many rows show one time.
    tick: Option<(f64, u64)>,
}

/// A step, or a time in any unit.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Moment {
    value: f64,
    /// A time of day, which begins anew at midnight.
    of_day: bool,
    /// In seconds, whatever the unit of numbers.
    is_date: bool,
    /// The cell says its time zone; the value is in UTC.
    is_utc: bool,
}

impl Clock {
    /// Counts rows.
    pub(crate) fn of_rows() -> Clock {
        Clock::default()
    }

    /// Reads this column.
    pub(crate) fn of_column(place: usize, name: &str) -> Clock {
        let is_step = name.eq_ignore_ascii_case(STEP);
        Clock { place: Some(place), is_step, unit_s: unit_s(name), ..Clock::default() }
    }

    /// The time from the first row to the latest \[s\]; `None` if no column tells it.
    pub(crate) fn passed_s(&self) -> Option<f64> {
        let (first, last) = self.first.zip(self.last)?;
        let unit_s = if last.is_date { 1.0 } else { self.unit_s };
        Some((last.value - first.value) * unit_s).filter(|_| !self.is_step)
    }

    /// When the first row was taken \[s since 1970\], and whether its cell says its time zone; `None` if no column tells its
    /// date.
    pub(crate) fn began_unix_s(&self) -> Option<(f64, bool)> {
        let first = self.first.filter(|_| !self.is_step)?;
        let seconds = match first.is_date {
            true => first.value - DAY_OF_1970 * DAY_S,
            false => first.value * self.unit_s,
        };
        let is_date = if first.is_date { !first.of_day } else { EPOCH_S.contains(&seconds) };
        is_date.then_some((seconds, first.is_utc || !first.is_date))
    }

    /// When a row is that follows so many steps after the first, in words; `None` if no column tells it.
    pub(crate) fn at(&self, steps: u64, step_s: f64) -> Option<String> {
        let first = self.first.filter(|_| !self.is_step)?;
        let unit_s = if first.is_date { 1.0 } else { self.unit_s };
        // A step that follows from many times is not exact.
        let seconds = (1e3 * (first.value * unit_s + steps as f64 * step_s)).round() / 1e3;
        if !first.is_date {
            return Some(format!("{seconds} s"));
        }
        let (day, of_day) = ((seconds / DAY_S).floor(), seconds.rem_euclid(DAY_S));
        let (minutes, rest) = ((of_day / 60.0).floor(), of_day % 60.0);
        let mut text = format!("{:02}:{:02}", (minutes / 60.0).floor(), minutes % 60.0);
        if step_s < 60.0 || rest >= 1.0 {
            text += &format!(":{:02}", rest.floor());
        }
        if !first.of_day {
            text = format!("{} {text}", date_of(day));
        }
        Some(if first.is_utc { text + " UTC" } else { text })
    }

    /// Rows missing before this one, whose cell this is; of the first row, its step.
    pub(crate) fn take(
        &mut self,
        cell: &[u8],
        mark: &mut Option<DecimalMark>,
    ) -> Result<u64, ClockError> {
        if self.is_step {
            let step = whole_step(cell, mark).map_err(ClockError::Cell)?;
            return match self.last.replace(Moment { value: step, ..Moment::default() }) {
                Some(last) if step <= last.value => Err(ClockError::Order(format!(
                    "step {step} after step {}; give each step once, rising",
                    last.value
                ))),
                Some(last) => Ok((step - last.value) as u64 - 1),
                None => Ok(step as u64),
            };
        }
        let text = decoded(cell);
        let Some(mut now) = moment(&text, mark) else {
            return Err(ClockError::Cell(format!("`{text}` is not a time")));
        };
        let Some(last) = self.last else {
            (self.first, self.last) = (Some(now), Some(now));
            return Ok(0);
        };
        if now.of_day {
            now.value += DAY_S * ((last.value - now.value) / DAY_S).round().max(0.0);
        }
        let passed = now.value - last.value;
        let usual = self.usual();
        if passed < 0.0 || (passed == 0.0 && self.is_steady()) {
            let what = if passed < 0.0 { "lies before the row above" } else { "is repeated" };
            return Err(ClockError::Order(format!(
                "time `{text}` {what}; give rows in order of time, or count them with --time none"
            )));
        }
        self.last = Some(now);
        self.remember(passed);
        let missing = match usual {
            Some(usual) if passed > GAP * usual => ((passed / usual).round() as u64).max(1) - 1,
            None => self.missing_of_coarse(passed),
            _ => 0,
        };
        self.shown = if passed == 0.0 { self.shown.max(1) + 1 } else { 1 };
        Ok(missing)
    }

    /// Rows missing where most rows show the time of the row before: only a time longer than a tick tells.
    fn missing_of_coarse(&mut self, passed: f64) -> u64 {
        if passed == 0.0 {
            return 0;
        }
        let (tick, rows) = self.tick.unwrap_or((f64::INFINITY, 0));
        self.tick = Some((tick.min(passed), rows.max(self.shown)));
        if passed <= GAP * tick || tick == 0.0 {
            return 0;
        }
        // The rows since the latest tick are there.
        ((passed / tick * rows as f64).round() as u64).saturating_sub(self.shown)
    }

    fn remember(&mut self, passed: f64) {
        if self.recent.len() < RECENT {
            self.recent.push(passed);
        } else {
            self.recent[self.taken % RECENT] = passed;
        }
        self.taken += 1;
    }

    /// The usual time difference, above 0.
    fn usual(&self) -> Option<f64> {
        let mut recent = [f64::INFINITY; RECENT];
        recent[..self.recent.len()].copy_from_slice(&self.recent);
        recent.sort_unstable_by(f64::total_cmp);
        // One row in three may follow a gap, and some may share their time.
        let usual = recent[self.recent.len().saturating_sub(1) * 2 / 3];
        Some(usual).filter(|usual| usual.is_finite() && *usual > 0.0)
    }

    fn is_steady(&self) -> bool {
        let least = self.recent.iter().copied().fold(f64::INFINITY, f64::min);
        self.recent.len() == RECENT && self.recent.iter().all(|passed| *passed < STEADY * least)
    }
}

/// Is a column of this name one of times?
pub(crate) fn is_time_name(name: &str) -> bool {
    let name = name.split(['[', '(']).next().unwrap_or(name).trim().to_lowercase();
    let name = name.trim_start_matches('#').trim_start();
    let units = ["_s", "_ms", "_us", "_µs", "_ns", "_min", "_h"];
    let name = units.iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name);
    TIMES.contains(&name)
}

/// Seconds of the unit in a column's name, else one second.
fn unit_s(name: &str) -> f64 {
    let unit = name.rsplit(['_', '[', '(']).next().unwrap_or(name);
    match unit.trim_end_matches([']', ')']).trim().to_lowercase().as_str() {
        "ns" => 1e-9,
        "us" | "µs" | "μs" => 1e-6,
        "ms" => 1e-3,
        "min" => 60.0,
        "h" => 3600.0,
        _ => 1.0,
    }
}

/// Does a clock read this cell?
pub(crate) fn is_moment(text: &str) -> bool {
    moment(text, &mut None).is_some()
}

/// Is this a date or a time of day?
pub(crate) fn is_date(text: &str) -> bool {
    date(text).is_some()
}

fn moment(text: &str, mark: &mut Option<DecimalMark>) -> Option<Moment> {
    match number(text.as_bytes(), mark) {
        Ok(value) if value.is_finite() => Some(Moment { value, ..Moment::default() }),
        Ok(_) | Err(_) => date(text),
    }
}

/// A time of day, with or without a date before it. Of a date whose order is not known only the time of
/// day counts.
fn date(text: &str) -> Option<Moment> {
    let text = text.trim_matches('"');
    let (day, rest) = match text.split_once(['T', ' ']) {
        Some((day, rest)) => (days(day)?, rest.trim()),
        None if text.contains(':') => (None, text),
        None => {
            return days(text)?.map(|days| Moment {
                value: days * DAY_S,
                is_date: true,
                ..Moment::default()
            });
        }
    };
    let is_utc = rest.ends_with(['Z', 'z']);
    let rest = rest.trim_end_matches(['Z', 'z']);
    let end = rest.find(|c: char| !c.is_ascii_digit() && !":.,".contains(c)).unwrap_or(rest.len());
    let (clock, after) = rest.split_at(end);
    let mut seconds = hours(clock)?;
    let mut is_offset = false;
    match after.trim() {
        "" => {}
        half if half.eq_ignore_ascii_case("am") || half.eq_ignore_ascii_case("pm") => {
            seconds %= DAY_S / 2.0;
            seconds += if half.eq_ignore_ascii_case("pm") { DAY_S / 2.0 } else { 0.0 };
        }
        offset => {
            let east = offset.strip_prefix('+').map(hours);
            let west = offset.strip_prefix('-').map(|west| hours(west).map(|west| -west));
            seconds -= east.or(west)??;
            is_offset = true;
        }
    }
    let value = day.map_or(seconds, |days| days * DAY_S + seconds);
    Some(Moment { value, of_day: day.is_none(), is_date: true, is_utc: is_utc || is_offset })
}

/// `hh:mm` or `hh:mm:ss.fff` in seconds.
fn hours(text: &str) -> Option<f64> {
    let mut parts = text.splitn(3, ':');
    let mut whole = || parts.next().map(|part| part.parse::<u32>().ok());
    let (hour, minute) = (whole()??, whole()??);
    let seconds = parts.next().map_or(Some(0.0), |part| part.replace(',', ".").parse().ok())?;
    let right = hour < 25 && minute < 60 && (0.0..61.0).contains(&seconds);
    right.then(|| f64::from(hour * 3600 + minute * 60) + seconds)
}

/// Days since a fixed day. The outer `None`: not a date; the inner `None`: day and month are ambiguous.
fn days(text: &str) -> Option<Option<f64>> {
    let mark = text.chars().find(|c| !c.is_ascii_digit())?;
    let parts: Vec<&str> = text.split(mark).collect();
    let [a, b, c] = parts[..] else { return None };
    let right = |part: &str, most| part.parse::<u32>().is_ok_and(|number| number <= most);
    let number = |part: &str| part.parse::<f64>().unwrap_or(0.0);
    let civil = |year: f64, month: f64, day: f64| {
        // March is the first month, so that the leap day is the last of a year.
        let (year, month) =
            if month > 2.0 { (year, month - 3.0) } else { (year - 1.0, month + 9.0) };
        let leap = (year / 4.0).floor() - (year / 100.0).floor() + (year / 400.0).floor();
        365.0 * year + leap + ((153.0 * month + 2.0) / 5.0).floor() + day
    };
    match mark {
        '-' | '/' if a.len() == 4 && right(a, 9999) && right(b, 12) && right(c, 31) => {
            Some(Some(civil(number(a), number(b), number(c))))
        }
        '.' if right(a, 31) && right(b, 12) && right(c, 9999) && c.len() >= 2 => {
            Some(Some(civil(number(c), number(b), number(a))))
        }
        '/' | '-' if right(a, 31) && right(b, 31) && right(c, 9999) => Some(None),
        _ => None,
    }
}

/// The date of a day as [`days`] counts them.
fn date_of(day: f64) -> String {
    let day = day as i64 - 1;
    let (era, day) = (day.div_euclid(146_097), day.rem_euclid(146_097));
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    // March is the first month.
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    format!("{:04}-{month:02}-{day:02}", year + 400 * era + next)
}

/// Reads a step, which is a whole number.
fn whole_step(cell: &[u8], mark: &mut Option<DecimalMark>) -> Result<f64, String> {
    match number(cell, mark) {
        Ok(step) if step.fract() == 0.0 && (0.0..=LARGEST_STEP).contains(&step) => Ok(step),
        _ => {
            let text = decoded(cell);
            Err(format!("invalid step `{text}`: expected a whole number from 0"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Missing rows before each, or what is wrong.
    fn missing(name: &str, cells: &[&str]) -> Vec<Result<u64, ClockError>> {
        let mut clock = Clock::of_column(0, name);
        cells.iter().map(|cell| clock.take(cell.as_bytes(), &mut None)).collect()
    }

    fn is_order(result: &Result<u64, ClockError>) -> bool {
        matches!(result, Err(ClockError::Order(_)))
    }

    #[test]
    fn steps_are_whole_numbers_that_rise() {
        assert_eq!(missing("Step", &["3", "9"]), [Ok(3), Ok(5)]);
        assert_eq!(missing(STEP, &["17", "18", "20.0", "1020"]), [Ok(17), Ok(0), Ok(1), Ok(999)]);
        assert!(missing(STEP, &["5", "5", "4"])[1..].iter().all(is_order));
        for cell in ["-1", "0.5", "1e300", "x", ""] {
            assert!(matches!(missing(STEP, &[cell])[0], Err(ClockError::Cell(_))), "{cell}");
        }
    }

    #[test]
    fn a_longer_time_than_usual_is_a_gap() {
        let times = ["0.00", "0.01", "0.02", "0.03", "0.07", "0.08", "0.095", "0.10"];
        let expected = [0, 0, 0, 0, 3, 0, 0, 0].map(Ok);
        assert_eq!(missing("t", &times), expected);
        let days = ["2024-02-28 23:59:58", "2024-02-28 23:59:59", "2024-02-29T00:00:00Z"];
        assert_eq!(missing("t", &days), [Ok(0), Ok(0), Ok(0)]);
        let german = ["28.02.2023 23:59", "01.03.2023 00:00", "01.03.2023 00:02"];
        assert_eq!(missing("t", &german), [Ok(0), Ok(0), Ok(1)]);
        let of_day = ["23:59:59,5", "0:00:00,0", "0:00:00,5", "0:00:02"];
        assert_eq!(missing("t", &of_day), [Ok(0), Ok(0), Ok(0), Ok(2)]);
        let halves = ["1/2/2024 11:59:59 AM", "1/2/2024 12:00:00 PM", "1/2/2024 12:00:01 PM"];
        assert_eq!(missing("t", &halves), [Ok(0), Ok(0), Ok(0)]);
        let offsets = ["2024-10-27T02:59:59+02:00", "2024-10-27T02:00:00+01:00"];
        assert_eq!(missing("t", &offsets), [Ok(0), Ok(0)]);
    }

    #[test]
    fn a_time_that_goes_back_or_is_repeated_is_refused() {
        assert!(is_order(&missing("t", &["2024-10-27 02:59:59", "2024-10-27 02:00:00"])[1]));
        let mut steady: Vec<String> = (0..12).map(|k| k.to_string()).collect();
        steady.push("11".into());
        let steady: Vec<&str> = steady.iter().map(String::as_str).collect();
        assert!(is_order(&missing("t", &steady)[12]));
        // A coarse clock shows several rows the same time.
        let coarse = ["1", "1", "1", "2", "2", "2", "3", "3", "3"];
        assert!(missing("t", &coarse).iter().all(|missing| *missing == Ok(0)));
    }

    /// A hundred rows a second on a clock of tenths; of rows 400 to 686 nothing is left.
    #[test]
    fn a_gap_shows_on_a_coarse_clock_too() {
        let rows = (0..400).chain(687..1200);
        let cells: Vec<String> =
            rows.map(|row| format!("{:.1}", f64::from(row / 10) / 10.0)).collect();
        let cells: Vec<&str> = cells.iter().map(String::as_str).collect();
        let found = missing("t", &cells);
        let sum: u64 = found.iter().map(|missing| missing.clone().unwrap()).sum();
        assert!(sum.abs_diff(287) <= 10, "{sum}");
        assert_eq!(found.iter().filter(|missing| **missing != Ok(0)).count(), 1);
    }

    #[test]
    fn a_row_s_time_is_told_as_its_column_tells_it() {
        let at = |name: &str, cell: &str, steps: u64, step_s: f64| {
            let mut clock = Clock::of_column(0, name);
            clock.take(cell.as_bytes(), &mut None).unwrap();
            clock.at(steps, step_s)
        };
        let told = |text: &str| Some(text.to_owned());
        assert_eq!(at("time", "2014-06-06 00:00", 393, 600.0), told("2014-06-08 17:30"));
        assert_eq!(at("time", "2024-02-28 23:59:58.5", 3, 0.5), told("2024-02-29 00:00:00"));
        assert_eq!(at("time", "31.12.1999 23:50", 1, 600.0), told("2000-01-01 00:00"));
        assert_eq!(at("t", "2024-10-27T02:59:59+02:00", 1, 1.0), told("2024-10-27 01:00:00 UTC"));
        assert_eq!(at("t", "23:59:59", 2, 1.0), told("00:00:01"));
        assert_eq!(at("t [ms]", "1500", 3, 0.25), told("2.25 s"));
        assert_eq!(at(STEP, "17", 3, 0.25), None);
        for day in 0..100_000 {
            let date = date_of(f64::from(day));
            assert_eq!(days(&date), Some(Some(f64::from(day))), "{date}");
        }
    }

    #[test]
    fn a_date_is_a_time_since_1970() {
        let began = |name: &str, cell: &str| {
            let mut clock = Clock::of_column(0, name);
            clock.take(cell.as_bytes(), &mut None).unwrap();
            clock.began_unix_s()
        };
        assert_eq!(began("t", "1970-01-01 00:00:01"), Some((1.0, false)));
        assert_eq!(began("t", "2024-10-27T02:59:59.5+02:00"), Some((1_729_990_799.5, true)));
        assert_eq!(began("timestamp", "1729990799.5"), Some((1_729_990_799.5, true)));
        assert_eq!(began("time_ms", "1729990799500"), Some((1_729_990_799.5, true)));
        for (name, cell) in
            [("t", "02:59:59"), ("t", "12.5"), (STEP, "1729990799"), ("t", "1/2/2024 11:59")]
        {
            assert_eq!(began(name, cell), None, "{cell}");
        }
    }

    #[test]
    fn columns_of_times_have_usual_names() {
        for name in [
            "t",
            "Time",
            "Time [s]",
            "TIMESTAMP",
            "X_Value",
            "time_s",
            "Zeit (ms)",
            "#time",
            "time_ns",
            "RECORD",
        ] {
            assert!(is_time_name(name), "{name}");
        }
        assert!(!is_time_name("temperature") && !is_time_name("ts2"));
    }
}
