//! A table as lines of text.

use comfy_table::Table;

use super::layout::{ROOMY, ROW_END, RULE};
use super::{TextTable, folding};
use crate::paint::{Colour, Paint};

impl TextTable {
    /// The text, no wider than `width`.
    pub(crate) fn text(&self, width: Option<u16>) -> String {
        self.painted(width, &[], Paint::NONE)
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
