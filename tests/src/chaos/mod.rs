//! Disturbances of a deployment that is watching a fault, and what must be true while they last and
//! after they have ended.
//!
//! While a disturbance lasts no component is wrongly reported faulty or wrongly explained, and what
//! cannot be judged is reported as such, with the reason. Within [`SETTLING`] steps of its end everything that
//! an undisturbed run in one process finds has been found, and nothing else.
//!
//! | file | job |
//! |---|---|
//! | `row` | a fault, when it begins and ends, and in which run |
//! | `stage` | the deployment of a row: its processes, and how far the plant has come |
//! | `disturbance` | what is done, each kind in a file of its own |
//! | `witness` | polls all states and subscribes to every transition |
//! | `judgement` | one component's state held against the undisturbed run |
//! | `record` | what the witness has seen so far |
//! | `table` | the rows with what was expected and seen |

pub mod disturbance;
mod judgement;
mod record;
pub mod row;
mod stage;
pub mod table;
mod witness;

/// How soon after the end of a disturbance everything is as if it had never been \[the plant's steps\]. Steps, because
/// on a busy machine plant and modules become slow together.
pub const SETTLING: u64 = 2000;
