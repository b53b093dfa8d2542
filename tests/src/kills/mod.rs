//! Diagnosers are killed again and again while faults come and go and an operator deals with them, and
//! what must be true of their journals all the while.
//!
//! | file | job |
//! |---|---|
//! | `plan` | which fault when, and who is killed when |
//! | `operator` | acknowledges and resets, so that components can be faulty once more |
//! | `collection` | every transition that a subscriber has ever got |
//! | `audit` | holds a module's history against what was collected and what was obeyed |
//! | `logs` | what the diagnosers said about their journals |
//! | `summary` | what came of it, in numbers |

pub mod audit;
pub mod collection;
pub mod logs;
pub mod operator;
pub mod plan;
pub mod summary;
