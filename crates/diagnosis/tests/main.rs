//! The diagnoser as a caller sees it. One program, so that tests which compute for a while run side by side.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "test code"
)]

mod any_series;
mod definition;
mod diagnoser;
mod fixture;
mod freeze_frames;
mod golden;
mod inputs;
mod learned;
mod liars;
mod long_run;
mod lossy_peers;
mod orders;
mod properties;
mod recorded_run;
mod restart;
mod sequence;
mod sequences;
mod shelving;
mod signals;
mod state;
