//! Who may do what, tried: strangers at the door, members who reach for what is not theirs, and beside
//! each of them somebody who may.

pub mod intruder;
pub mod letters;
pub mod stand;
pub mod table;
