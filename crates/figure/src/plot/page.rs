//! A figure: rows of panels on a page.

use svg::Document;
use svg::node::element::{Description, Group, Rectangle, Title};

use super::ink::{self, Anchor};
use super::layout::PlotLayout;
use super::legend;
use super::panel::Panel;
use super::panel_drawing;

/// Width of every figure \[px\]; on A4 paper, text then has 7 points.
const WIDTH: f64 = 860.0;
const MARGIN: f64 = 12.0;
/// Space left of a plot for its axis \[px\].
const AXIS: f64 = 62.0;
/// Space between two panels of a row \[px\].
const BETWEEN: f64 = 14.0;
/// Space between two rows \[px\].
const ROW_GAP: f64 = 8.0;
/// Space right of a plot without legend: half a tick label \[px\].
const NO_LEGEND: f64 = 14.0;
const TITLE_SIZE: f64 = 16.0;
/// Height of a line below the title \[px\].
const LINE: f64 = 16.0;

/// Panels side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelRow {
    /// Height of the plots \[px\].
    pub height_px: f64,
    /// The panels.
    pub panels: Vec<Panel>,
    /// Number of columns of equal width; with fewer panels, the right side stays empty.
    pub columns: usize,
}

impl PanelRow {
    /// A row filled by its panels.
    #[must_use]
    pub fn new(height_px: f64, panels: Vec<Panel>) -> Self {
        Self { height_px, columns: panels.len(), panels }
    }

    /// The same row divided into this many columns.
    #[must_use]
    pub fn columns(self, columns: usize) -> Self {
        Self { columns, ..self }
    }

    /// At least the number of panels.
    fn divisions(&self) -> usize {
        self.columns.max(self.panels.len()).max(1)
    }
}

/// A figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// The subject, on one line.
    pub title: String,
    /// More details, below the title; may be empty.
    pub subtitle: String,
    /// A textual description for readers who cannot see the figure.
    pub description: String,
    /// The rows.
    pub rows: Vec<PanelRow>,
}

impl Figure {
    /// The figure as an SVG document, to be written to a file or embedded in a page. It has no identifiers, so a page
    /// may contain several.
    #[must_use]
    pub fn svg(&self) -> String {
        let (heading, mut top) = self.heading();
        let mut panels = Group::new();
        let mut number = 0;
        let lettered = self.rows.iter().map(|row| row.panels.len()).sum::<usize>() > 1;
        for row in &self.rows {
            let layouts = self.layouts(row);
            let above = layouts.iter().map(PlotLayout::above).fold(0.0, f64::max);
            let below = layouts.iter().map(PlotLayout::below).fold(0.0, f64::max);
            for layout in layouts {
                let name = if lettered { letter(number) } else { String::new() };
                let plot_top = top + above;
                let height = row.height_px;
                panels = panels.add(panel_drawing::draw(&layout, &name, top, plot_top, height));
                number += 1;
            }
            top += above + row.height_px + below + ROW_GAP;
        }
        let height = (top + MARGIN).ceil();
        Document::new()
            .set("viewBox", (0, 0, WIDTH, height))
            .set("width", WIDTH)
            .set("height", height)
            .set("role", "img")
            .set("font-family", ink::FONT)
            .set("fill", ink::INK)
            .add(Title::new(&self.title))
            .add(Description::new().add(svg::node::Text::new(&self.description)))
            .add(Rectangle::new().set("width", WIDTH).set("height", height).set("fill", ink::PAPER))
            .add(heading)
            .add(panels)
            .to_string()
    }

    /// Draws title and subtitle; returns the position below them.
    fn heading(&self) -> (Group, f64) {
        let title = ink::text([MARGIN, MARGIN + 14.0], &self.title, TITLE_SIZE, Anchor::Start);
        let mut group = Group::new().add(title.set("font-weight", "bold"));
        let mut y = MARGIN + 14.0;
        for line in wrapped(&self.subtitle, WIDTH - 2.0 * MARGIN) {
            y += LINE;
            let words = ink::text([MARGIN, y], &line, ink::BODY, Anchor::Start);
            group = group.add(words.set("fill", ink::FAINT));
        }
        (group, y + 1.5 * ROW_GAP)
    }

    fn layouts<'a>(&self, row: &'a PanelRow) -> Vec<PlotLayout<'a>> {
        let count = row.divisions() as f64;
        let legends = self.legend_widths(row.divisions());
        let beside = BETWEEN * (count - 1.0) + AXIS * count + legends.iter().sum::<f64>();
        let plot = (WIDTH - 2.0 * MARGIN - beside) / count;
        let mut left = MARGIN;
        let place = |(panel, legend): (&'a Panel, &f64)| {
            let right = left + AXIS + plot + legend;
            let layout = PlotLayout::new(panel, [left + AXIS, plot], [left, right]);
            left = right + BETWEEN;
            layout
        };
        row.panels.iter().zip(&legends).map(place).collect()
    }

    /// The width for legends in each column. Rows with the same number of columns reserve the same, so that their plots
    /// are aligned.
    fn legend_widths(&self, columns: usize) -> Vec<f64> {
        let rows = || self.rows.iter().filter(|row| row.divisions() == columns);
        let of = |column| {
            let panels = rows().filter_map(|row| row.panels.get(column));
            panels.map(legend::width).fold(NO_LEGEND, f64::max)
        };
        (0..columns).map(of).collect()
    }
}

/// (a), (b), …
fn letter(number: u8) -> String {
    format!("({})", char::from(b'a' + number % 26))
}

/// Wraps a text into lines of about this width. No-break spaces do not separate words.
fn wrapped(words: &str, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split(' ').filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if ink::width(line, ink::BODY) + ink::width(word, ink::BODY) < width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
