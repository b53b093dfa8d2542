//! Tables of numbers: CSV with a header row.

mod cells;
mod column;
mod rows;

pub(crate) use rows::Rows;
