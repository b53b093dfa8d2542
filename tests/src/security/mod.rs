//! Access control, tested: unauthorised clients, members that exceed their rights, and for each of them a
//! permitted counterpart.

pub mod intruder;
pub mod letters;
pub mod silence;
pub mod stand;
pub mod table;
