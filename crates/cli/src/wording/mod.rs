//! How states, kinds of faults, steps, times, residuals and reasons are worded for people: one place, so that every
//! command uses the same words.

mod doubt;
mod identification;
mod phase;
mod quantity;
mod reason;
mod state;
mod time;

pub(crate) use names::printable;

pub(crate) use doubt::why_unconfirmed;
pub(crate) use identification::{
    brief, candidate, decimals, fault_size, identified, in_small_units, kind, percent,
};
pub(crate) use phase::{phase_colour, phase_in_words};
pub(crate) use quantity::{force, ratio, residual, span};
pub(crate) use reason::reason;
pub(crate) use state::{later_state, state_colour, state_in_words};
pub(crate) use time::{now_unix_ns, utc};

/// What stands where there is no value.
pub(crate) const NOTHING: &str = "-";

/// A value, or what stands where there is none.
pub(crate) fn or_nothing<T: ToString>(value: Option<T>) -> String {
    value.map_or_else(|| NOTHING.to_owned(), |value| value.to_string())
}
