//! The freeze frame of a component's fault: what was seen around its latching.
//!
//! | file | job |
//! |---|---|
//! | `terminal` | drawn with characters |
//! | `rows` | as CSV |

mod rows;
mod terminal;

pub(super) use figure::freeze_frame::svg;
pub(super) use rows::csv;
pub(super) use terminal::{WIDEST, text};
