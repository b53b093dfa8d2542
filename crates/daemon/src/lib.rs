//! The processes: plant and diagnoser over Zenoh.
//!
//! A thin shell around the pure crates. The diagnoser's process: [`diagnoser::run`] opens the session
//! and starts one task for each job; the one that owns the `diagnosis::Diagnoser` is
//! `diagnoser/diagnose`, and nothing in it waits for the network. The plant's process:
//! [`plant::run`], with the simulation on a thread of its own; in its place [`player::run`] publishes recorded
//! samples. The recorder's: [`recorder::run`], which writes on a thread of its own. What all share with every other process
//! is in the crate `shell`.

pub mod config;
pub mod diagnoser;
pub mod plant;
pub mod player;
pub mod recorder;

mod counters;
mod messages;
mod metrics;
mod readiness;
mod status_line;
