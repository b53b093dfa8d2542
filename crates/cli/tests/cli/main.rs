//! The subcommands through the real binary.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot set itself up has failed"
)]

mod binary;
mod calibrate;
mod check;
mod demo;
mod detect;
mod detect_modules;
mod model;
mod study;
