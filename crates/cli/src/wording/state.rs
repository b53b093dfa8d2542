//! States of components.

use wire::{FaultState, FaultTransition};

use crate::paint::Colour;

/// In words: without a comparison with its reference nothing is simply normal.
pub(crate) fn state_in_words(transition: &FaultTransition) -> String {
    let state = transition.state;
    let unverified = state == FaultState::Normal && !transition.is_verified();
    if unverified { format!("{state}, not verified") } else { state.to_string() }
}

/// Of a state that is unknown because a later version reported it; otherwise it would say why it is unknown.
pub(crate) fn later_state(transition: &FaultTransition) -> Option<&'static str> {
    let is_later = transition.state == FaultState::Unknown && transition.unknown.is_none();
    is_later.then_some("its state, perhaps a fault, is one that only a later version knows")
}

/// In colour.
pub(crate) fn state_colour(state: FaultState) -> Colour {
    match state {
        FaultState::Latched | FaultState::Acknowledged => Colour::Red,
        FaultState::Explained => Colour::Green,
        FaultState::Unconfirmed | FaultState::Unknown => Colour::Yellow,
        FaultState::Normal | FaultState::Tentative => Colour::Dim,
    }
}
