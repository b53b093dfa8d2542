//! The subcommands through the real binary.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot set itself up has failed"
)]

mod binary;
mod check;
mod demo;
mod detect;
mod model;
