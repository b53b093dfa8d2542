//! The subcommands through the real binary.
#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a test that cannot set itself up has failed"
)]

mod binary;
mod calibrate;
mod check;
mod commission;
mod demo;
mod detect;
mod detect_modules;
mod export;
mod fault;
mod faults;
mod follow;
mod generate;
mod health;
mod history;
mod import;
mod inject;
mod join;
mod learn;
mod model;
mod new;
mod orders;
mod pki;
mod program;
mod record;
#[expect(dead_code, reason = "the tests of the crate `replay` use all of it")]
#[path = "../../../replay/tests/replay/live.rs"]
mod recorded_live;
mod replay;
mod replicate;
mod schema;
mod simulate;
mod stand_in;
mod stroke;
mod study;
mod unreadable;
