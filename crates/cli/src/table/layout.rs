//! The columns of a table side by side.

use comfy_table::{LineStyle, Table, TableStyle, presets};

use super::TextTable;

/// The line under the heading.
pub(super) const RULE: char = '─';
/// The line between two rows, which shows where a row ends and is not printed.
pub(super) const ROW_END: char = '\u{1e}';

/// How far apart columns stand.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spacing {
    style: TableStyle,
    padding: (u16, u16),
}

/// Three blanks between columns, and two before the first.
pub(super) const ROOMY: Spacing =
    Spacing { style: ruled(LineStyle::new(RULE, RULE, RULE, RULE)), padding: (1, 1) };
/// Two blanks between columns, and none before the first.
pub(super) const DENSE: Spacing =
    Spacing { style: ruled(LineStyle::none().fill(RULE).junction(RULE)), padding: (0, 1) };

const fn ruled(rule: LineStyle) -> TableStyle {
    presets::NOTHING.header_separator(rule).row_separator(LineStyle::none().fill(ROW_END))
}

impl TextTable {
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
