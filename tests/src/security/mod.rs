//! Access control, tested: unauthorised clients, members that exceed their rights, and for each of them a
//! permitted counterpart.

pub mod ears;
pub mod fleet;
pub mod intruder;
pub mod letters;
pub mod member;
pub mod silence;
pub mod stand;
pub mod table;
mod trace;
