//! States of components.

use crate::{FaultState, FaultTransition};

/// In words: without a comparison with its reference nothing is simply normal, and what is not monitored now is in no
/// state but the last known one.
pub fn state_in_words(transition: &FaultTransition) -> String {
    match transition.state() {
        FaultState::Normal if !transition.is_verified() => "normal, not verified".to_owned(),
        state if transition.is_last_known() => format!("{state}, last known"),
        state => state.to_string(),
    }
}
