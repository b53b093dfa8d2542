//! A picture of judged readings: each channel's lowest and highest in each column, what was found of it shaded, and what
//! it should have read while it was faulty. The memory needed does not grow with the recording.

use std::path::Path;

use diagnosis::state::learned::{ChannelState, ChannelVerdict, LearnedJudge};
use figure::plot::{Figure, Panel, PanelRow, PlotAxis, Series, SeriesStyle, Shape};

use crate::failure::Failure;

/// Most columns: about one a pixel.
const MOST_COLUMNS: usize = 1600;
/// Height of a channel \[px\].
const HEIGHT: f64 = 70.0;

/// A channel in the rows of a column.
#[derive(Debug, Clone, Copy)]
struct Cell {
    lowest: f64,
    highest: f64,
    expected: f64,
    worst: ChannelState,
}

impl Cell {
    const EMPTY: Self = Self {
        lowest: f64::NAN,
        highest: f64::NAN,
        expected: f64::NAN,
        worst: ChannelState::Normal,
    };

    /// The column of both; of numbers and not numbers, the numbers remain.
    fn joined(self, later: Self) -> Self {
        Self {
            lowest: self.lowest.min(later.lowest),
            highest: self.highest.max(later.highest),
            expected: if later.expected.is_nan() { self.expected } else { later.expected },
            worst: self.worst.max(later.worst),
        }
    }
}

/// The columns so far.
pub(super) struct Picture {
    rows: usize,
    per_column: usize,
    /// Of each column, a cell for each channel.
    columns: Vec<Vec<Cell>>,
}

impl Picture {
    pub(super) fn new() -> Self {
        Self { rows: 0, per_column: 1, columns: Vec::new() }
    }

    /// Takes a row that the judge has taken.
    pub(super) fn take(&mut self, sample: &[f64], judge: &LearnedJudge) {
        if self.rows == self.per_column * MOST_COLUMNS {
            let join = |pair: &[Vec<Cell>]| {
                let both = pair[0].iter().zip(&pair[pair.len() - 1]);
                both.map(|(one, other)| one.joined(*other)).collect()
            };
            self.columns = self.columns.chunks(2).map(join).collect();
            self.per_column *= 2;
        }
        let place = self.rows / self.per_column;
        self.columns.resize(place + 1, vec![Cell::EMPTY; sample.len()]);
        for (channel, (cell, &value)) in self.columns[place].iter_mut().zip(sample).enumerate() {
            let expected = judge.expected(channel).map_or(f64::NAN, |[expected, _]| expected);
            let (lowest, highest) = (value, value);
            *cell = cell.joined(Cell { lowest, highest, expected, ..Cell::EMPTY });
        }
        self.rows += 1;
    }

    /// Shades what a verdict is about.
    pub(super) fn shade(&mut self, verdict: &ChannelVerdict) {
        let place = |row: u64| usize::try_from(row).unwrap_or(usize::MAX) / self.per_column;
        let last = place(verdict.last).min(self.columns.len().saturating_sub(1));
        for column in self.columns.iter_mut().take(last + 1).skip(place(verdict.first)) {
            let is_meant = |channel| verdict.channel.is_none_or(|own| own == channel);
            for (_, cell) in column.iter_mut().enumerate().filter(|(k, _)| is_meant(*k)) {
                cell.worst = cell.worst.max(verdict.state);
            }
        }
    }

    /// Writes the picture.
    pub(super) fn write(&self, file: &Path, title: &str, names: &[String]) -> Result<(), Failure> {
        let last = names.len().saturating_sub(1);
        let rows = names.iter().enumerate().map(|(channel, name)| {
            let x = PlotAxis::linear("row").over([0.0, self.rows.max(1) as f64]);
            let x = if channel == last { x } else { x.bare() };
            PanelRow::new(HEIGHT, vec![self.panel(channel, name, x)])
        });
        let figure = Figure {
            title: title.to_owned(),
            subtitle: "Readings, in their own units; shaded: what was found.".to_owned(),
            description: format!("Readings of {} and what was found of them.", names.join(", ")),
            rows: rows.collect(),
        };
        std::fs::write(file, figure.svg()).map_err(|error| Failure::unwritable(file, error))
    }

    fn panel(&self, channel: usize, name: &str, x: PlotAxis) -> Panel {
        let cells = || {
            let at = |place: usize| (place * self.per_column) as f64;
            self.columns.iter().enumerate().map(move |(k, column)| (at(k), &column[channel]))
        };
        let values = cells().flat_map(|(_, cell)| [cell.lowest, cell.highest, cell.expected]);
        let [low, high] = values
            .filter(|value| value.is_finite())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)]);
        let margin = 0.05 * (high - low).max(f64::EPSILON * high.abs()).max(f64::MIN_POSITIVE);
        let range = if low <= high { [low - margin, high + margin] } else { [0.0, 1.0] };
        let line = |name: &str, style, points| Series::new(name, Shape::Line, style, points);
        let mut series = Vec::new();
        for (state, colour) in
            [(ChannelState::Unknown, 5), (ChannelState::NoSignal, 7), (ChannelState::Faulty, 1)]
        {
            let mut label = state.as_str().replace('_', " ");
            for [from, to] in self.spans(channel, state) {
                let points = vec![[from, range[0]], [to, range[0]]];
                let style = SeriesStyle::nth(colour).solid();
                series
                    .push(line(&std::mem::take(&mut label), style, points).spread(vec![range; 2]));
            }
        }
        let readings = cells().flat_map(|(row, cell)| [[row, cell.lowest], [row, cell.highest]]);
        series.push(line("", SeriesStyle::nth(0).solid(), readings.collect()));
        let expected: Vec<[f64; 2]> = cells().map(|(row, cell)| [row, cell.expected]).collect();
        if expected.iter().any(|[_, value]| value.is_finite()) {
            series.push(line(
                "expected",
                SeriesStyle { dash: "4 2", ..SeriesStyle::nth(4) },
                expected,
            ));
        }
        Panel::new(name, x, PlotAxis::linear("").over(range), series)
    }

    /// First row and end of each stretch of columns in a state.
    fn spans(&self, channel: usize, state: ChannelState) -> Vec<[f64; 2]> {
        let mut spans: Vec<[usize; 2]> = Vec::new();
        let found = self.columns.iter().enumerate().filter(|(_, c)| c[channel].worst == state);
        for (place, _) in found {
            match spans.last_mut().filter(|[_, end]| *end == place) {
                Some([_, end]) => *end = place + 1,
                None => spans.push([place, place + 1]),
            }
        }
        let rows = |columns: usize| (columns * self.per_column).min(self.rows) as f64;
        spans.into_iter().map(|span| span.map(rows)).collect()
    }
}
