//! Properties of every decoder, for any input.
//!
//! A [`Target`] takes any bytes and panics unless what it promises holds of them; never only that
//! nothing panics. The bytes come from the corpus kept in `corpus/`, which an ordinary test replays, or
//! from libFuzzer, which `.ci/fuzz` builds around the same targets.
//!
//! | file | promise |
//! |---|---|
//! | `target/message` | what is decoded encodes, and decodes to the same |
//! | `target/key` | what is a key prints as it was read, and is a key to the network too |
//! | `target/question` | a query's parameters are written and read back |
//! | `target/journal` | exactly the lines that fit their checksums are records; appending goes on |
//! | `target/state` | what a restarted diagnoser remembers, it remembers after the next restart too |
//! | `target/structure` | a description written out describes the same; its modules can be cut out |
//! | `target/configuration` | what is accepted works, a mistake is named with its line or its key |
//!
//! Everywhere: a refusal is one line of bearable length.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test code: a broken promise is a panic"
)]

mod corpus;
mod refusal;
mod target;
mod workbench;

pub use corpus::{directory, inputs, recorded_targets};
pub use target::{TARGETS, Target};
