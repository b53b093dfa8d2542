//! States of components.

use wire::FaultState;

use crate::paint::Colour;

/// In colour.
pub(crate) fn state_colour(state: FaultState) -> Colour {
    match state {
        FaultState::Latched | FaultState::Acknowledged => Colour::Red,
        FaultState::Explained => Colour::Green,
        FaultState::Unconfirmed | FaultState::Unknown => Colour::Yellow,
        FaultState::Normal | FaultState::Tentative => Colour::Dim,
    }
}
