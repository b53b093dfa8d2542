//! How margins develop over hours to months: what is kept of them in a fixed space, and when a component that comes
//! nearer to a limit will reach it.

use std::collections::BTreeMap;
use std::f64::consts::SQRT_2;

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};
use vocabulary::Margins;

const MINUTE_S: u64 = 60;
const HOUR_S: u64 = 60 * MINUTE_S;
const DAY_S: u64 = 24 * HOUR_S;

/// Days with values that a forecast needs.
const LEAST_DAYS: usize = 7;
/// Days that a growth must have been going on for.
const LEAST_GROWING: u64 = 3;
/// By how much the Bayesian information criterion of a line that begins to rise has to be better than that of a constant.
const EVIDENCE: f64 = 10.0;
/// The farthest that a forecast reaches \[days\].
const HORIZON_DAYS: f64 = 5.0 * 365.25;
/// The largest correlation of successive days that is believed.
const MOST_CORRELATED: f64 = 0.9;

/// A span of time over which margins are kept, in intervals of equal length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrendSpan {
    /// An hour.
    Hour,
    /// A day.
    Day,
    /// A month.
    Month,
    /// A year.
    Year,
}

impl TrendSpan {
    /// All of them.
    pub const ALL: [TrendSpan; 4] =
        [TrendSpan::Hour, TrendSpan::Day, TrendSpan::Month, TrendSpan::Year];

    /// The length of an interval \[s\].
    #[must_use]
    pub fn interval_s(self) -> u64 {
        match self {
            TrendSpan::Hour => 20,
            TrendSpan::Day => 10 * MINUTE_S,
            TrendSpan::Month => 4 * HOUR_S,
            TrendSpan::Year => DAY_S,
        }
    }

    /// The number of intervals that are kept.
    #[must_use]
    pub fn intervals(self) -> u64 {
        match self {
            TrendSpan::Hour => HOUR_S / TrendSpan::Hour.interval_s(),
            TrendSpan::Day => DAY_S / TrendSpan::Day.interval_s(),
            TrendSpan::Month => 31 * DAY_S / TrendSpan::Month.interval_s(),
            TrendSpan::Year => 366,
        }
    }

    /// The number of the interval that a time belongs to.
    #[must_use]
    pub fn interval(self, time_unix_s: u64) -> u64 {
        time_unix_s / self.interval_s()
    }
}

/// The values of one test within an interval.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "(u32, f32, f32)", into = "(u32, f32, f32)")]
pub struct Summary {
    /// How many there were.
    pub count: u32,
    /// Their mean.
    pub mean: f32,
    /// The farthest from 0.
    pub extreme: f32,
}

impl From<(u32, f32, f32)> for Summary {
    fn from((count, mean, extreme): (u32, f32, f32)) -> Self {
        Self { count, mean, extreme }
    }
}

impl From<Summary> for (u32, f32, f32) {
    fn from(summary: Summary) -> Self {
        (summary.count, summary.mean, summary.extreme)
    }
}

impl Summary {
    /// Adds a value; ignores NaN and infinities.
    #[expect(clippy::cast_possible_truncation, reason = "seven digits are enough to draw")]
    pub fn add(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.count = self.count.saturating_add(1);
        self.mean += (value as f32 - self.mean) / self.count as f32;
        if value.abs() > f64::from(self.extreme).abs() {
            self.extreme = value as f32;
        }
    }
}

/// The summaries of a component within an interval, in the order of [`Margins::TESTS`].
pub type ComponentSummary = [Summary; Margins::TESTS.len()];

/// The summaries of a module's components within an interval.
pub type ModuleSummary = BTreeMap<String, ComponentSummary>;

/// Adds what a status says to the summaries of an interval.
pub fn add_margins(summaries: &mut ModuleSummary, margins: &[Margins]) {
    for of_component in margins {
        let summary = summaries.entry(of_component.component.to_string()).or_default();
        for (summary, (_, share)) in summary.iter_mut().zip(of_component.shares()) {
            share.into_iter().for_each(|share| summary.add(share));
        }
    }
}

/// When a component will reach a limit if it goes on as it has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Forecast {
    /// Days until then, as likely too many as too few.
    pub days: f64,
    /// The interval that contains the real number with a probability of 95 % \[days\].
    pub interval_days: [f64; 2],
    /// Change of the share of the limit in a day.
    pub per_day: f64,
}

impl Forecast {
    /// In words: "at this rate its limit in 9 days (6 to 15)".
    #[must_use]
    pub fn words(&self) -> String {
        let [low, high] = self.interval_days.map(|days| format!("{days:.0}"));
        let days = self.days.round();
        let unit = if days == 1.0 { "day" } else { "days" };
        format!("at this rate its limit in {days:.0} {unit} ({low} to {high})")
    }
}

/// The means of days, from (start of an interval \[s since 1970\], summary).
#[must_use]
pub fn daily(summaries: impl IntoIterator<Item = (u64, Summary)>) -> Vec<(u64, f64)> {
    let mut days: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    for (time_unix_s, Summary { count, mean, .. }) in summaries {
        let (sum, total) = days.entry(time_unix_s / DAY_S).or_default();
        *sum += f64::from(count) * f64::from(mean);
        *total += f64::from(count);
    }
    let known = days.into_iter().filter(|(_, (_, total))| *total > 0.0);
    known.map(|(day, (sum, total))| (day, sum / total)).collect()
}

/// Forecasts from the means of days, `(day, mean share of the limit)`, when the share reaches 1 or -1. `None` if it does
/// not come nearer, or too little for a date.
///
/// The share is taken to be constant up to an unknown day and to rise or fall along a line from then on, with errors that
/// are normal and, from day to day, correlated. Each day on which the growth may have begun is weighted by how well a
/// line from there fits; the date's distribution is the mixture of their predictions (Student's t).
#[must_use]
pub fn forecast(days: &[(u64, f64)]) -> Option<Forecast> {
    if days.len() < LEAST_DAYS {
        return None;
    }
    let first = fit_all(days, 0.0);
    let correlation = correlation(days, likeliest(&first)?).clamp(0.0, MOST_CORRELATED);
    let lines = fit_all(days, correlation);
    let best = likeliest(&lines)?;
    let n = days.len() as f64;
    let constant = constant_error(days, correlation);
    if n * (constant / best.error).ln() - 2.0 * n.ln() < EVIDENCE {
        return None;
    }
    let exponent = (n - 4.0) / 2.0;
    let weighted: Vec<(f64, &GrowthLine)> =
        lines.iter().map(|line| ((best.error / line.error).powf(exponent), line)).collect();
    let total: f64 = weighted.iter().map(|(weight, _)| weight).sum();
    let sign = best.slope.signum();
    let student = StudentsT::new(0.0, 1.0, n - 4.0).ok()?;
    let now = days.last()?.0 as f64 + 1.0;
    let reached_within = |ahead: f64| {
        let each = weighted.iter().map(|(weight, line)| {
            let (value, deviation) = line.at(now + ahead);
            weight * student.cdf((sign * value - 1.0) / deviation)
        });
        each.sum::<f64>() / total
    };
    let quantile = |share: f64| {
        if reached_within(HORIZON_DAYS) < share {
            return None;
        }
        let (mut low, mut high) = (0.0, HORIZON_DAYS);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            if reached_within(middle) < share { low = middle } else { high = middle }
        }
        Some(high)
    };
    let slope = weighted.iter().map(|(weight, line)| weight * line.slope).sum::<f64>() / total;
    let interval_days = [quantile(0.025)?, quantile(0.975)?];
    Some(Forecast { days: quantile(0.5)?, interval_days, per_day: slope })
}

/// A line that begins to rise, or fall, on a day.
#[derive(Debug, Clone, Copy)]
struct GrowthLine {
    begin: f64,
    level: f64,
    slope: f64,
    /// Of the residuals, the sum of squares.
    error: f64,
    /// The variance of a residual, and the inverse of the normal equations: of the level, of both, of the slope.
    variance: f64,
    inverse: [f64; 3],
}

impl GrowthLine {
    /// Its value at a time \[days\], and that value's standard deviation.
    fn at(&self, time: f64) -> (f64, f64) {
        let rise = (time - self.begin).max(0.0);
        let [level, both, slope] = self.inverse;
        let variance = self.variance * (level + rise * (2.0 * both + rise * slope));
        (self.level + self.slope * rise, variance.max(f64::MIN_POSITIVE).sqrt())
    }
}

/// Rows without the correlation between successive days: of a day's regressors and value, what the day before does not
/// say.
fn whitened<const N: usize>(
    days: &[(u64, f64)],
    correlation: f64,
    row: impl Fn(usize) -> [f64; N],
) -> Vec<[f64; N]> {
    let alone = (1.0 - correlation * correlation).sqrt();
    let rows = (0..days.len()).map(|k| {
        let own = row(k);
        if k > 0 && days[k].0 == days[k - 1].0 + 1 {
            let before = row(k - 1);
            std::array::from_fn(|place| own[place] - correlation * before[place])
        } else {
            own.map(|value| alone * value)
        }
    });
    rows.collect()
}

/// A line for each day on which the growth may have begun.
fn fit_all(days: &[(u64, f64)], correlation: f64) -> Vec<GrowthLine> {
    let Some(((first, _), (last, _))) = days.first().zip(days.last()) else { return Vec::new() };
    let begins = 2 * (last + 1 - first).saturating_sub(LEAST_GROWING);
    let begin = |k| *first as f64 + 0.5 * k as f64;
    (0..=begins).filter_map(|k| fit(days, begin(k), correlation)).collect()
}

fn fit(days: &[(u64, f64)], begin: f64, correlation: f64) -> Option<GrowthLine> {
    let rows = whitened(days, correlation, |k| {
        let (day, value) = days[k];
        [1.0, (day as f64 + 0.5 - begin).max(0.0), value]
    });
    let sum = |a: usize, b: usize| rows.iter().map(|row| row[a] * row[b]).sum::<f64>();
    let (s00, s01, s11, s02, s12) = (sum(0, 0), sum(0, 1), sum(1, 1), sum(0, 2), sum(1, 2));
    let determinant = s00 * s11 - s01 * s01;
    if determinant <= 1e-9 * s00 * s11 {
        return None;
    }
    let inverse = [s11 / determinant, -s01 / determinant, s00 / determinant];
    let level = inverse[0] * s02 + inverse[1] * s12;
    let slope = inverse[1] * s02 + inverse[2] * s12;
    let error: f64 =
        rows.iter().map(|row| (row[2] - level * row[0] - slope * row[1]).powi(2)).sum();
    let error = error.max(f64::MIN_POSITIVE);
    let variance = error / (days.len() as f64 - 4.0);
    Some(GrowthLine { begin, level, slope, error, variance, inverse })
}

fn likeliest(lines: &[GrowthLine]) -> Option<&GrowthLine> {
    lines.iter().min_by(|a, b| a.error.total_cmp(&b.error))
}

/// The correlation between a line's residuals of successive days.
fn correlation(days: &[(u64, f64)], line: &GrowthLine) -> f64 {
    let rest: Vec<f64> =
        days.iter().map(|(day, value)| value - line.at(*day as f64 + 0.5).0).collect();
    let pairs = (1..days.len()).filter(|k| days[*k].0 == days[k - 1].0 + 1);
    let together: f64 = pairs.map(|k| rest[k] * rest[k - 1]).sum();
    let alone: f64 = rest.iter().map(|value| value * value).sum();
    // Three parameters were fitted, which takes from the correlation about this much.
    if alone > 0.0 { together / alone + 2.0 * SQRT_2 / days.len() as f64 } else { 0.0 }
}

/// The sum of squares that a constant leaves.
fn constant_error(days: &[(u64, f64)], correlation: f64) -> f64 {
    let rows = whitened(days, correlation, |k| [1.0, days[k].1]);
    let sum = |a: usize, b: usize| rows.iter().map(|row| row[a] * row[b]).sum::<f64>();
    let level = sum(0, 1) / sum(0, 0);
    rows.iter().map(|row| (row[1] - level * row[0]).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const DAYS: u64 = 28;

    /// Seconds that are drawn at once. The means of intervals are distributed as with a value a second (with which the
    /// first test takes a minute and holds as well).
    const AT_ONCE_S: u64 = 20;

    /// Four weeks of a margin, a value a second: white noise, a slow disturbance, day and night, and a fault that grows
    /// from some day on. Returns the means of days, and in how many days it reaches its limit.
    fn four_weeks(seed: u64, grows: bool) -> (Vec<(u64, f64)>, f64) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let level = rng.random_range(-0.2..0.2);
        let begin = rng.random_range(0.0..14.0);
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let at_end = rng.random_range(0.35..0.85);
        let slope = if grows { at_end / (DAYS as f64 - begin) } else { 0.0 };
        let (white, slow, daily_swing) = (
            rng.random_range(0.05..0.4),
            rng.random_range(0.01..0.04),
            rng.random_range(0.0..0.15),
        );
        // Of the slow disturbance, the correlation time.
        let remaining = (-(AT_ONCE_S as f64) / (HOUR_S as f64 * rng.random_range(1.0..8.0))).exp();
        let step = slow * (1.0 - remaining * remaining).sqrt();
        let mut disturbance = slow * normal(&mut rng);
        let mut intervals: BTreeMap<u64, Summary> = BTreeMap::new();
        let white = white / (AT_ONCE_S as f64).sqrt();
        for second in (0..DAYS * DAY_S).step_by(AT_ONCE_S as usize) {
            let day = second as f64 / DAY_S as f64;
            disturbance = remaining * disturbance + step * normal(&mut rng);
            let mean = level + sign * slope * (day - begin).max(0.0);
            let swing = daily_swing * (std::f64::consts::TAU * day).sin();
            let value = mean + disturbance + swing + white * normal(&mut rng);
            intervals.entry(TrendSpan::Month.interval(second)).or_default().add(value);
        }
        let of_month = TrendSpan::Month.interval_s();
        let summaries = intervals.into_iter().map(|(k, summary)| (k * of_month, summary));
        let reached = begin + (1.0 - sign * level) / slope;
        (daily(summaries), reached - DAYS as f64)
    }

    fn normal(rng: &mut ChaCha8Rng) -> f64 {
        StandardNormal.sample(rng)
    }

    fn of_seeds(grows: bool, seeds: std::ops::Range<u64>) -> Vec<(Option<Forecast>, f64)> {
        let half = seeds.start.midpoint(seeds.end);
        let of = |seeds: std::ops::Range<u64>| -> Vec<(Option<Forecast>, f64)> {
            seeds
                .map(|seed| {
                    let (days, real) = four_weeks(seed, grows);
                    (forecast(&days), real)
                })
                .collect()
        };
        std::thread::scope(|scope| {
            let first = scope.spawn(|| of(seeds.start..half));
            let mut second = of(half..seeds.end);
            second.extend(first.join().unwrap());
            second
        })
    }

    #[test]
    fn the_interval_holds_the_real_date_as_often_as_it_says() {
        let all = of_seeds(true, 20000..20200);
        let holds = |(forecast, real): &&(Option<Forecast>, f64)| {
            forecast.is_some_and(|Forecast { interval_days: [low, high], .. }| {
                (low..=high).contains(real)
            })
        };
        let held = all.iter().filter(holds).count();
        let none = all.iter().filter(|(forecast, _)| forecast.is_none()).count();
        assert!((184..=196).contains(&held), "{held} of {}, {none} without a forecast", all.len());
    }

    #[test]
    fn what_does_not_grow_has_no_date() {
        let all = of_seeds(false, 2000..2100);
        let dated = all.iter().filter(|(forecast, _)| forecast.is_some()).count();
        assert!(dated <= 2, "{dated} of 100");
    }

    #[test]
    fn few_days_and_flat_lines_have_no_date_and_a_straight_line_has_its_own() {
        let line = |days: u64, slope: f64| -> Vec<(u64, f64)> {
            let wobble = |day: u64| if day.is_multiple_of(2) { 1e-3 } else { -1e-3 };
            (0..days).map(|day| (day, slope * (day as f64 + 0.5) + wobble(day))).collect()
        };
        assert_eq!(forecast(&line(6, 0.05)), None);
        assert_eq!(forecast(&line(20, 0.0)), None);
        let rising = forecast(&line(10, 0.05)).unwrap();
        assert!((rising.days - 10.0).abs() < 0.2, "{rising:?}");
        assert_eq!(rising.words(), "at this rate its limit in 10 days (10 to 10)");
        let falling = forecast(&line(10, -0.05)).unwrap();
        assert!((falling.days - 10.0).abs() < 0.2 && falling.per_day < 0.0, "{falling:?}");
    }

    #[test]
    fn a_summary_is_the_mean_and_the_farthest_and_numbers_only() {
        let mut summary = Summary::default();
        [0.25, -0.75, f64::NAN, 0.5].into_iter().for_each(|value| summary.add(value));
        assert_eq!(summary, Summary { count: 3, mean: 0.0, extreme: -0.75 });
    }
}
