//! Campaigns, figures and reports as a caller sees them. One program, so that tests which compute for a while run side
//! by side.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

mod calibration;
mod campaign;
mod conditions;
mod controllers;
mod engine;
mod explain;
mod export;
mod figures;
mod gaps;
mod histories;
mod identification;
mod limits;
mod more_modules;
mod pareto_reference;
mod read_model;
mod report;
mod rig;
mod rivals;
mod sampling_rates;
mod structures;
mod summary;
mod tolerance;
mod tower;
mod trace;
