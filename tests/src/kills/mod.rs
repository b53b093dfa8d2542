//! Diagnosers are killed repeatedly while faults come and go and an operator handles them, and what must
//! hold of their journals throughout.
//!
//! | file | job |
//! |---|---|
//! | `plan` | which fault when, and which diagnoser is killed when |
//! | `operator` | acknowledges and resets, so that components can become faulty again |
//! | `collection` | every transition that a subscriber has received |
//! | `audit` | compares a module's history with collected transitions and obeyed commands |
//! | `logs` | what the diagnosers logged about their journals |
//! | `summary` | the counts |

pub mod audit;
pub mod collection;
pub mod logs;
pub mod operator;
pub mod plan;
pub mod summary;
