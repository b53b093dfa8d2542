//! How much attention a state or a phase asks for: what colours and symbols show beside the words.

use crate::{FaultState, ModulePhase};

/// From what needs attention to what needs none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Tone {
    /// A fault, acknowledged or not; a module that gives no verdicts though it should.
    Alarm,
    /// It is not known whether it is healthy.
    Doubt,
    /// It changed, and what explains that is known.
    Explained,
    /// Nothing.
    Calm,
}

/// Of a component's state.
#[must_use]
pub fn state_tone(state: FaultState) -> Tone {
    match state {
        FaultState::Latched | FaultState::Acknowledged => Tone::Alarm,
        FaultState::Unconfirmed | FaultState::Unknown => Tone::Doubt,
        FaultState::Explained => Tone::Explained,
        FaultState::Normal | FaultState::Tentative => Tone::Calm,
    }
}

/// Of a module's phase.
#[must_use]
pub fn phase_tone(phase: ModulePhase) -> Tone {
    match phase {
        ModulePhase::Stale => Tone::Alarm,
        ModulePhase::Waiting | ModulePhase::Initialising => Tone::Doubt,
        ModulePhase::InService => Tone::Calm,
    }
}
