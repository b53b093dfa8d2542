//! Colours for the rows of a table.

use comfy_table::Table;

use crate::paint::{Colour, Paint};

/// Lines of a table above its first row: heading and rule.
const HEADING: usize = 2;

/// The text of a table, each row in its colour. Painted as a whole line, for the codes of colours would
/// count as width in a cell.
pub(crate) fn painted(table: &Table, colours: &[Option<Colour>], paint: Paint) -> String {
    let mut lines = Vec::new();
    for (number, line) in table.trim_fmt().lines().enumerate() {
        let row = number.checked_sub(HEADING);
        let colour = row.and_then(|row| colours.get(row).copied().flatten());
        lines.push(match colour {
            Some(colour) => paint.in_colour(colour, line),
            None => line.to_owned(),
        });
    }
    lines.join("\n")
}
