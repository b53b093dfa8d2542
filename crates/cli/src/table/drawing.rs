//! A table as lines of text.

use comfy_table::{LineStyle, Table, TableStyle, presets};

use super::{TextTable, folding};
use crate::paint::{Colour, Paint};

/// The line under the heading.
const RULE: char = '─';
/// The line between two rows, which shows where a row ends and is not printed.
const ROW_END: char = '\u{1e}';

/// How far apart columns stand.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spacing {
    style: TableStyle,
    padding: (u16, u16),
}

/// Three blanks between columns, and two before the first.
const ROOMY: Spacing =
    Spacing { style: ruled(LineStyle::new(RULE, RULE, RULE, RULE)), padding: (1, 1) };
/// Two blanks between columns, and none before the first.
pub(super) const DENSE: Spacing =
    Spacing { style: ruled(LineStyle::none().fill(RULE).junction(RULE)), padding: (0, 1) };

const fn ruled(rule: LineStyle) -> TableStyle {
    presets::NOTHING.header_separator(rule).row_separator(LineStyle::none().fill(ROW_END))
}

impl TextTable {
    /// The text, no wider than `width`.
    pub(crate) fn text(&self, width: Option<u16>) -> String {
        self.painted(width, &[], Paint::for_terminal(false))
    }

    /// The text, no wider than `width`, each row in its colour. Painted line by line, for the codes of
    /// colours would count as width in a cell.
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
        // Rows of several lines would run into each other.
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
            Some(width) if is_wider(&drawn, width) => folding::folded(self, width),
            _ => drawn,
        }
    }

    pub(super) fn drawn(&self, spacing: Spacing) -> Table {
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

/// All lines of a table are equally wide.
fn is_wider(drawn: &Table, width: u16) -> bool {
    drawn.lines().next().is_some_and(|line| line.chars().count() > usize::from(width))
}

#[cfg(test)]
mod tests {
    use crate::table::table;

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
