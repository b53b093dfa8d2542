//! Plant, diagnosers and recorder as a caller sees them: over the network, from their files, as processes.
//!
//! One program: linking Zenoh takes longer than most of these tests, which mostly wait and so run side by side.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot set itself up has failed"
)]

mod bad_configs;
mod corrected;
mod end_to_end;
mod hostile_input;
mod identification;
mod inputs;
mod late_peer;
mod other_versions;
mod processes;
mod recorder;
mod shelving;
mod shipped_configs;
mod shut_off;
mod stroke;
mod support;
mod two_of_one_module;
