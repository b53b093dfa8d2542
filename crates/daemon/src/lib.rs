//! The processes: plant and diagnoser over Zenoh.
//!
//! A thin shell around the pure crates. The diagnoser's shell: [`diagnoser::run`] opens the session
//! and starts one task for each job; the one that owns the `diagnosis::Diagnoser` is
//! `diagnoser/diagnosis_loop.rs`, and nothing in it waits for the network. The plant's shell:
//! [`plant::run`], with the simulation on a thread of its own. What a service manager is told of either:
//! `supervision`. What is served over HTTP: [`health`].
//!
//! Exit codes are those of [`exit::Failure`].

pub mod config;
pub mod diagnoser;
pub mod environment;
pub mod exit;
pub mod health;
pub mod loopback;
pub mod observer;
pub mod plant;
pub mod router;
pub mod session;
pub mod shutdown;
pub mod thresholds;

mod audience;
mod clock;
mod convert;
mod logging;
mod messages;
mod occurrences;
mod refusals;
mod runtime;
mod supervision;
