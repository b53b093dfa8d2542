//! Journals as a caller sees them, with real files, real processes and real deaths.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "test code")]

mod child;
mod damage;
mod disk_full;
mod following;
mod kill;
mod lock;
mod model;
mod opening;
mod reading;
mod rotation;
mod support;
