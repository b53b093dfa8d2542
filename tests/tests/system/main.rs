//! Real processes over a real network. One program, so that tests which mostly wait run side by side; each
//! states at its beginning whether it needs the machine for itself (`turn`).

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

mod broken_machine;
mod chaos;
mod closed_loop;
mod equality;
mod fleet;
mod flood;
mod footprint;
mod freeze_frames;
mod kills;
mod lab;
mod large_messages;
mod latency;
mod learned;
mod life_cycle;
mod missed_events;
mod overload;
mod plain_clients;
mod recorder_kills;
mod recordings;
mod restart;
mod scaling;
mod security;
mod shelving;
mod silent_peer;
mod soak;
mod stalled_subscriber;
mod tls_traffic;
mod web_load;
