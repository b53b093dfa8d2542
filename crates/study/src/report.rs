//! A report as a single HTML file: text, tables and figures, without scripts or external resources.

use std::fmt::Write;

use crate::statistics::Interval95;

/// What is reported.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StudyReport {
    /// Title.
    pub title: String,
    /// Paragraphs below the title.
    pub paragraphs: Vec<String>,
    /// Tables.
    pub tables: Vec<Table>,
    /// Figures.
    pub figures: Vec<ReportFigure>,
}

/// A table of a report. Columns whose cells all begin with a number are right-aligned.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Title.
    pub title: String,
    /// A note on the table; may be empty.
    pub note: String,
    /// The headings of the columns.
    pub heading: Vec<String>,
    /// The rows, each with as many cells as the heading.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without a note.
    #[must_use]
    pub fn new(title: &str, heading: &[&str], rows: Vec<Vec<String>>) -> Self {
        let heading = heading.iter().map(ToString::to_string).collect();
        Self { title: title.to_owned(), note: String::new(), heading, rows }
    }

    /// The table with a note.
    #[must_use]
    pub fn with_note(self, note: impl Into<String>) -> Self {
        Self { note: note.into(), ..self }
    }
}

/// A share as a percentage.
#[must_use]
pub fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// An interval of a share as percentages.
#[must_use]
pub fn interval(Interval95(low, high): Interval95) -> String {
    format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
}

/// A figure of a report.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReportFigure {
    /// Name of its file, without the extension.
    pub name: &'static str,
    /// Its caption.
    pub caption: String,
    /// An SVG document, inserted into the page unchanged.
    pub svg: String,
}

/// Plain style for light and dark screens and for paper. Figures keep a white background, for which their colours were
/// chosen.
const STYLE: &str = "\
:root { color-scheme: light dark; }
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1, h2 { line-height: 1.2; }
h2 { margin-top: 2.5rem; font-size: 1.2rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 0.25rem 0.75rem; text-align: left; border-bottom: 1px solid #8888; }
thead th { border-bottom: 2px solid; vertical-align: bottom; }
.number { text-align: right; }
figure { margin: 2.5rem 0; }
figure > svg { display: block; width: 100%; height: auto; background: #fff; }
figcaption, .note { font-size: 0.9rem; opacity: 0.8; }
@media print {
  :root { color-scheme: light; }
  body { max-width: none; margin: 0; padding: 0; font-size: 10pt; }
  figure, tr, h2 { break-inside: avoid; }
  h2 { break-after: avoid; }
  figure > svg { max-height: 24cm; }
  .scroll { overflow: visible; }
}";

/// The report as an HTML document.
#[must_use]
pub fn html(report: &StudyReport) -> String {
    let title = escape(&report.title);
    let body: Vec<String> = (report.paragraphs.iter().map(|words| paragraph("", words)))
        .chain(report.tables.iter().map(table))
        .chain(report.figures.iter().enumerate().map(figure))
        .collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n<main>\n\
         <h1>{title}</h1>\n{}\n</main>\n</body>\n</html>\n",
        body.join("\n")
    )
}

fn paragraph(class: &str, words: &str) -> String {
    match (class, words) {
        (_, "") => String::new(),
        ("", _) => format!("<p>{}</p>", escape(words)),
        _ => format!("<p class=\"{class}\">{}</p>", escape(words)),
    }
}

fn table(table: &Table) -> String {
    let numeric: Vec<bool> = (0..table.heading.len()).map(|at| is_numeric(table, at)).collect();
    let class = |at: usize| match numeric.get(at) {
        Some(true) => " class=\"number\"",
        _ => "",
    };
    let mut rows = String::new();
    for row in &table.rows {
        let cells = row.iter().enumerate();
        let cells = cells.map(|(at, cell)| format!("<td{}>{}</td>", class(at), escape(cell)));
        // Writing to a string cannot fail.
        let _ = writeln!(rows, "<tr>{}</tr>", cells.collect::<String>());
    }
    let heading = table.heading.iter().enumerate();
    let heading = heading
        .map(|(at, cell)| format!("<th scope=\"col\"{}>{}</th>", class(at), escape(cell)))
        .collect::<String>();
    format!(
        "<section>\n<h2>{}</h2>\n{}\n<div class=\"scroll\">\n<table>\n\
         <thead>\n<tr>{heading}</tr>\n</thead>\n<tbody>\n{rows}</tbody>\n</table>\n</div>\n</section>",
        escape(&table.title),
        paragraph("note", &table.note),
    )
}

/// Whether every non-empty cell of the column begins with a number.
fn is_numeric(table: &Table, column: usize) -> bool {
    let begins_like_one = |cell: &str| {
        let digits = cell.trim_start_matches(['-', '−', '+', '<', '>', '≤', '≥', '±', '≈', ' ']);
        digits.starts_with(|c: char| c.is_ascii_digit())
    };
    let mut cells = table.rows.iter().filter_map(|row| row.get(column));
    let mut said = cells.by_ref().filter(|cell| !matches!(cell.as_str(), "" | "-" | "–" | "—"));
    let any = said.next();
    any.is_some_and(|cell| begins_like_one(cell)) && said.all(|cell| begins_like_one(cell))
}

fn figure((number, figure): (usize, &ReportFigure)) -> String {
    format!(
        "<figure>\n{}\n<figcaption>Figure {}. {}</figcaption>\n</figure>",
        without_prolog(&figure.svg),
        number + 1,
        escape(&figure.caption)
    )
}

/// An SVG document without its prolog, which is permitted only at the start of a file.
fn without_prolog(svg: &str) -> &str {
    svg.find("<svg").and_then(|start| svg.get(start..)).unwrap_or(svg).trim_end()
}

/// Escapes text for HTML.
fn escape(words: &str) -> String {
    words
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}
