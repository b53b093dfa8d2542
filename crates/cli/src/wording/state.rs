//! States of components.

use wire::{FaultState, FaultTransition};

use crate::paint::Colour;

/// In words: without a comparison with its reference nothing is simply normal.
pub(crate) fn state_in_words(transition: &FaultTransition) -> String {
    let state = transition.state;
    let unverified = state == FaultState::Normal && !transition.is_verified();
    if unverified { format!("{state}, not verified") } else { state.to_string() }
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
