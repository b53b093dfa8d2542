//! States of components.

use wire::{FaultState, FaultTransition};

/// In words: without a comparison with its reference nothing is simply normal.
pub fn state_in_words(transition: &FaultTransition) -> String {
    let state = transition.state;
    let unverified = state == FaultState::Normal && !transition.is_verified();
    if unverified { format!("{state}, not verified") } else { state.to_string() }
}

/// Of a state that is unknown because a later version reported it; otherwise it would say why it is unknown.
pub fn later_state(transition: &FaultTransition) -> Option<&'static str> {
    let is_later = transition.state == FaultState::Unknown && transition.unknown.is_none();
    is_later.then_some("its state, perhaps a fault, is one that only a later version knows")
}
