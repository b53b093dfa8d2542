//! The form of the tables that are printed.

use comfy_table::{LineStyle, Row, Table, presets};

const RULE: LineStyle = LineStyle::new('─', '─', '─', '─');

/// A table with nothing but a rule below its header.
pub(crate) fn headed(header: impl Into<Row>) -> Table {
    let mut grid = Table::new();
    grid.load_style(presets::NOTHING.header_separator(RULE));
    grid.set_header(header);
    grid
}
