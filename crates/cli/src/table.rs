//! Tables for people: columns under a ruled heading, nothing else.

use comfy_table::{LineStyle, Table, presets};

/// An empty table with this heading.
pub(crate) fn table(heading: &[&str]) -> Table {
    let mut table = Table::new();
    let rule = LineStyle::new('─', '─', '─', '─');
    table.load_style(presets::NOTHING.header_separator(rule)).set_header(heading.iter().copied());
    table
}
