//! States of components.

use crate::{FaultState, FaultTransition};

/// In words: without a comparison with its reference nothing is simply normal.
pub fn state_in_words(transition: &FaultTransition) -> String {
    let state = transition.state();
    let unverified = state == FaultState::Normal && !transition.is_verified();
    if unverified { format!("{state}, not verified") } else { state.to_string() }
}
