//! How states, kinds of faults, steps, times, residuals and reasons are worded for people: one place, so that every
//! command, the page and the terminal view use the same words.

mod aside;
mod doubt;
mod identification;
mod order;
mod phase;
mod quantity;
mod reason;
mod state;
mod time;
mod tone;

pub use crate::printable;

pub use aside::{aside, state_and_aside, until};
pub use identification::{
    brief, candidate, decimals, fault_size, identified, in_small_units, percent,
};
pub use order::{UNTAKEN, done, not_saved, perhaps};
pub use phase::phase_in_words;
pub use quantity::{at_detection, departure, force, ratio, residual, span};
pub use reason::{ordered, present_reason, reason};
pub use state::state_in_words;
pub use time::{age, lasting, parse_utc, parse_utc_or_ago, utc};
pub use tone::{Tone, phase_tone, state_tone};

/// The placeholder for a missing value.
pub const NOTHING: &str = "-";

/// A value, or the placeholder for a missing one.
pub fn or_nothing<T: ToString>(value: Option<T>) -> String {
    value.map_or_else(|| NOTHING.to_owned(), |value| value.to_string())
}
