//! A table made narrower: columns one below the other, cells over several lines. Words stay whole as long as
//! there is room for them.

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Table, Width};

use super::layout::DENSE;
use super::{BLANK, Column, TextTable};

/// Blanks beside each column.
const MARGIN: usize = 2;
/// What is left to each of the other columns before one keeps its words whole.
const LEAST: usize = 8;

/// The table, drawn in this width.
pub(super) fn folded(table: &TextTable, width: u16) -> Table {
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

/// The column that the columns of a stack share.
fn shared(columns: &[Column], stack: &[usize]) -> Column {
    let members: Vec<&Column> = stack.iter().filter_map(|place| columns.get(*place)).collect();
    let headings: Vec<&str> = members.iter().map(|column| column.heading.as_str()).collect();
    let right = members.iter().all(|column| column.alignment == CellAlignment::Right);
    let mut breaks = members.iter().map(|column| column.break_at);
    Column {
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
    let of_column = |(place, column): (usize, &Column)| {
        let cells = table.rows.iter().filter_map(|row| row.get(place));
        let cells = cells.map(|cell| of_text(cell, column.break_at));
        cells.max().unwrap_or_default().max(of_text(&column.heading, column.break_at))
    };
    table.columns.iter().enumerate().map(of_column).collect()
}

/// From the first column on: what identifies a row stands there.
fn keep_words_whole(drawn: &mut Table, words: &[usize], width: u16) {
    let mut room = usize::from(width).saturating_sub(MARGIN * words.len());
    let mut others: usize = words.iter().map(|word| LEAST.min(*word)).sum();
    for (column, &word) in drawn.column_iter_mut().zip(words) {
        others -= LEAST.min(word);
        let fits = word + others <= room;
        if fits {
            // The blank that the column has at its end counts.
            let whole = u16::try_from(word + 1).unwrap_or(u16::MAX);
            column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(whole)));
        }
        room = room.saturating_sub(if fits { word } else { LEAST.min(word) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::table;

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
}
