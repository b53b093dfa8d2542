//! Tables in readable form: columns under a ruled heading. A table wider than permitted is folded: its cells take
//! several lines.

mod width;

use comfy_table::{
    CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, Table, TableStyle, Width,
    presets,
};
use vocabulary::printable;

use crate::paint::{Colour, Paint};

pub(crate) use width::{WidthArguments, terminal_width};

/// The character at which cells are broken, unless a column specifies another.
const BLANK: char = ' ';

/// Spaces beside each column.
const MARGIN: usize = 2;
/// Width left for each other column before a column keeps its words whole.
const LEAST: usize = 8;

/// The line under the heading.
const RULE: char = '─';
/// Internal mark of the end of a row, which is not printed.
const ROW_END: char = '\u{1e}';

/// Spacing of columns.
#[derive(Debug, Clone, Copy)]
struct Spacing {
    style: TableStyle,
    padding: (u16, u16),
}

/// Three spaces between columns, and two before the first.
const ROOMY: Spacing =
    Spacing { style: ruled(LineStyle::new(RULE, RULE, RULE, RULE)), padding: (1, 1) };
/// Two spaces between columns, and none before the first.
const DENSE: Spacing =
    Spacing { style: ruled(LineStyle::none().fill(RULE).junction(RULE)), padding: (0, 1) };

const fn ruled(rule: LineStyle) -> TableStyle {
    presets::NOTHING.header_separator(rule).row_separator(LineStyle::none().fill(ROW_END))
}

/// A table that is being filled.
#[derive(Debug, Clone)]
pub(crate) struct TextTable {
    columns: Vec<TextColumn>,
    rows: Vec<Vec<String>>,
    /// Columns that share a column in a folded table; empty if each is separate.
    stacks: Vec<Vec<usize>>,
}

/// A column without its cells.
#[derive(Debug, Clone)]
struct TextColumn {
    heading: String,
    alignment: CellAlignment,
    /// The character that is replaced by a line break within a cell.
    break_at: char,
}

/// An empty table with this heading.
pub(crate) fn table(heading: &[&str]) -> TextTable {
    let column = |heading: &&str| TextColumn {
        heading: (*heading).to_owned(),
        alignment: CellAlignment::Left,
        break_at: BLANK,
    };
    TextTable {
        columns: heading.iter().map(column).collect(),
        rows: Vec::new(),
        stacks: Vec::new(),
    }
}

impl TextTable {
    /// Adds a row with a cell for each column. Escapes control characters in cells, because the text may come from
    /// other parties.
    pub(crate) fn add_row(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(cells.into_iter().map(|cell| printable(&cell.into())).collect());
    }

    /// Aligns the cells of these columns right.
    pub(crate) fn align_right(&mut self, columns: impl IntoIterator<Item = usize>) {
        for column in columns {
            if let Some(column) = self.columns.get_mut(column) {
                column.alignment = CellAlignment::Right;
            }
        }
    }

    /// Marks a column of times, which may be broken between day and hour.
    pub(crate) fn break_times(&mut self, column: usize) {
        if let Some(column) = self.columns.get_mut(column) {
            column.break_at = 'T';
        }
    }

    /// In a folded table, shows the cells of the columns of a stack one below the other.
    pub(crate) fn stack(&mut self, stacks: &[&[usize]]) {
        self.stacks = stacks.iter().map(|stack| stack.to_vec()).collect();
    }

    /// The text, at most `width` wide.
    pub(crate) fn text(&self, width: Option<u16>) -> String {
        self.painted(width, &[], Paint::NONE)
    }

    /// The text, at most `width` wide, with each row in its colour. Colours are added line by line, because the escape
    /// codes would count as width in a cell.
    pub(crate) fn painted(
        &self,
        width: Option<u16>,
        colours: &[Option<Colour>],
        paint: Paint,
    ) -> String {
        let drawn = self.fitting(width);
        let lines: Vec<String> = drawn.lines().map(|line| line.trim_end().to_owned()).collect();
        let rule = lines.iter().position(|line| line.starts_with(RULE));
        let (heading, rows) = lines.split_at(rule.map_or(0, |rule| rule + 1));
        let rows: Vec<&[String]> = rows.split(|line| is_row_end(line)).collect();
        // Without separation, rows of several lines would not be distinguishable.
        let apart = rows.iter().any(|row| row.len() > 1);
        let mut text = heading.to_vec();
        for (number, row) in rows.into_iter().enumerate() {
            if apart && number > 0 {
                text.push(String::new());
            }
            let colour = colours.get(number).copied().flatten();
            text.extend(row.iter().map(|line| match colour {
                Some(colour) => paint.in_colour(colour, line),
                None => line.clone(),
            }));
        }
        text.join("\n")
    }

    fn fitting(&self, width: Option<u16>) -> Table {
        let drawn = self.drawn(ROOMY);
        match width {
            Some(width) if is_wider(&drawn, width) => folded(self, width),
            _ => drawn,
        }
    }

    fn drawn(&self, spacing: Spacing) -> Table {
        let mut drawn = Table::new();
        drawn.load_style(spacing.style);
        drawn.set_header(self.columns.iter().map(|column| column.heading.as_str()));
        for row in &self.rows {
            drawn.add_row(row);
        }
        for (column, described) in drawn.column_iter_mut().zip(&self.columns) {
            column
                .set_padding(spacing.padding)
                .set_delimiter(described.break_at)
                .set_cell_alignment(described.alignment);
        }
        drawn
    }
}

fn is_row_end(line: &str) -> bool {
    line.trim_start().starts_with(ROW_END)
}

/// Whether the table is too wide; all its lines have the same width.
fn is_wider(drawn: &Table, width: u16) -> bool {
    drawn.lines().next().is_some_and(|line| line.chars().count() > usize::from(width))
}

/// The table, folded to this width.
fn folded(table: &TextTable, width: u16) -> Table {
    let stacked = stacked(table);
    let mut drawn = stacked.drawn(DENSE);
    drawn.set_content_arrangement(ContentArrangement::Dynamic).set_width(width);
    keep_words_whole(&mut drawn, &longest_words(&stacked), width);
    drawn
}

fn stacked(table: &TextTable) -> TextTable {
    let TextTable { columns, rows, stacks } = table;
    if stacks.is_empty() {
        return table.clone();
    }
    let cell = |row: &[String], stack: &[usize]| {
        let cells = stack.iter().filter_map(|place| row.get(*place).map(String::as_str));
        cells.collect::<Vec<&str>>().join("\n")
    };
    let row = |row: &Vec<String>| -> Vec<String> {
        stacks.iter().map(|stack| cell(row, stack)).collect()
    };
    TextTable {
        columns: stacks.iter().map(|stack| shared(columns, stack)).collect(),
        rows: rows.iter().map(row).collect(),
        stacks: Vec::new(),
    }
}

/// The column shared by the columns of a stack.
fn shared(columns: &[TextColumn], stack: &[usize]) -> TextColumn {
    let members: Vec<&TextColumn> = stack.iter().filter_map(|place| columns.get(*place)).collect();
    let headings: Vec<&str> = members.iter().map(|column| column.heading.as_str()).collect();
    let right = members.iter().all(|column| column.alignment == CellAlignment::Right);
    let mut breaks = members.iter().map(|column| column.break_at);
    TextColumn {
        heading: headings.join("\n"),
        alignment: if right { CellAlignment::Right } else { CellAlignment::Left },
        break_at: breaks.find(|break_at| *break_at != BLANK).unwrap_or(BLANK),
    }
}

/// The length of the longest word of each column.
fn longest_words(table: &TextTable) -> Vec<usize> {
    let of_text = |text: &str, break_at: char| {
        let words = text.split(['\n', break_at]).map(|word| word.chars().count());
        words.max().unwrap_or_default()
    };
    let of_column = |(place, column): (usize, &TextColumn)| {
        let cells = table.rows.iter().filter_map(|row| row.get(place));
        let cells = cells.map(|cell| of_text(cell, column.break_at));
        cells.max().unwrap_or_default().max(of_text(&column.heading, column.break_at))
    };
    table.columns.iter().enumerate().map(of_column).collect()
}

/// Starts with the first columns, because they identify the row.
fn keep_words_whole(drawn: &mut Table, words: &[usize], width: u16) {
    let mut room = usize::from(width).saturating_sub(MARGIN * words.len());
    let mut others: usize = words.iter().map(|word| LEAST.min(*word)).sum();
    for (column, &word) in drawn.column_iter_mut().zip(words) {
        others -= LEAST.min(word);
        let fits = word + others <= room;
        if fits {
            // The width includes the space at the end of the column.
            let whole = u16::try_from(word + 1).unwrap_or(u16::MAX);
            column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(whole)));
        }
        room = room.saturating_sub(if fits { word } else { LEAST.min(word) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REASON: &str = "acknowledged by ada@station: looks loose";

    fn transitions() -> TextTable {
        let mut rows = table(&["component", "time", "state", "why"]);
        rows.add_row(["module1/actuator/a3", "2026-11-18T11:06:40.750Z", "acknowledged", REASON]);
        rows.add_row(["module2/sensor/g1", "2026-11-18T11:06:41.000Z", "latched", "-"]);
        rows.break_times(1);
        rows.stack(&[&[0], &[2, 1], &[3]]);
        rows
    }

    fn widest(text: &str) -> usize {
        text.lines().map(|line| line.chars().count()).max().unwrap()
    }

    #[test]
    fn a_folded_table_fits_and_its_words_are_whole() {
        let text = transitions().text(Some(60));
        assert!(widest(&text) <= 60, "{text}");
        let words = REASON.split(' ').chain(["module1/actuator/a3", "latched", "2026-11-18"]);
        for word in words.chain(["11:06:40.750Z", "module2/sensor/g1"]) {
            assert!(text.contains(word), "`{word}` is not whole in\n{text}");
        }
        let blank_lines = text.lines().filter(|line| line.is_empty()).count();
        assert_eq!(blank_lines, 1, "one between two rows: {text}");
    }

    #[test]
    fn where_nothing_fits_words_are_torn_but_no_line_is_too_long() {
        for width in [20, 30, 40] {
            let text = transitions().text(Some(width));
            assert!(widest(&text) <= usize::from(width), "{text}");
        }
    }

    #[test]
    fn without_a_limit_every_row_is_one_line() {
        assert_eq!(transitions().text(None).lines().count(), 4);
    }

    #[test]
    fn a_table_that_fits_is_the_same_with_a_limit() {
        let mut counts = table(&["what", "count"]);
        counts.add_row(["questions", "7"]);
        counts.add_row(["changes", "12"]);
        counts.align_right([1]);
        let rule = "─".repeat(21);
        let rows = "  questions       7\n  changes        12";
        let expected = format!("  what        count\n{rule}\n{rows}");
        for width in [None, Some(80), Some(21)] {
            assert_eq!(counts.text(width), expected, "{width:?}");
        }
        assert_ne!(counts.text(Some(20)), expected);
    }

    #[test]
    fn a_table_without_rows_is_its_heading() {
        assert_eq!(table(&["what"]).text(None).lines().count(), 2);
    }
}
