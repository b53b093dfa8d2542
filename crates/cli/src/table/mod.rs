//! Tables for people: columns under a ruled heading, nothing else. One that is wider than it may be is
//! folded: its cells take several lines.

mod drawing;
mod folding;
mod layout;
mod width;

use comfy_table::CellAlignment;
use vocabulary::printable;

pub(crate) use width::{WidthArguments, terminal_width};

/// Where cells are broken, unless a column says otherwise.
const BLANK: char = ' ';

/// A table that is being filled.
#[derive(Debug, Clone)]
pub(crate) struct TextTable {
    columns: Vec<Column>,
    rows: Vec<Vec<String>>,
    /// Columns that share one in a folded table; empty if each has its own.
    stacks: Vec<Vec<usize>>,
}

/// A column without its cells.
#[derive(Debug, Clone)]
struct Column {
    heading: String,
    alignment: CellAlignment,
    /// The character that a line of a cell may end in place of.
    break_at: char,
}

/// An empty table with this heading.
pub(crate) fn table(heading: &[&str]) -> TextTable {
    let column = |heading: &&str| Column {
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
    /// Adds a row with a cell for each column. A cell is one line, whoever its text is from.
    pub(crate) fn add_row(&mut self, cells: impl IntoIterator<Item = impl Into<String>>) {
        self.rows.push(cells.into_iter().map(|cell| printable(&cell.into())).collect());
    }

    /// The cells of these columns end at the same place.
    pub(crate) fn align_right(&mut self, columns: impl IntoIterator<Item = usize>) {
        for column in columns {
            if let Some(column) = self.columns.get_mut(column) {
                column.alignment = CellAlignment::Right;
            }
        }
    }

    /// The cells of this column are times, which may be broken between day and hour.
    pub(crate) fn break_times(&mut self, column: usize) {
        if let Some(column) = self.columns.get_mut(column) {
            column.break_at = 'T';
        }
    }

    /// In a folded table, the cells of the columns of a stack stand one below the other.
    pub(crate) fn stack(&mut self, stacks: &[&[usize]]) {
        self.stacks = stacks.iter().map(|stack| stack.to_vec()).collect();
    }
}
