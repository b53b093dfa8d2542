//! Phases of modules.

use wire::ModulePhase;

use crate::paint::Colour;

/// In words.
pub(crate) fn phase_in_words(phase: ModulePhase) -> &'static str {
    match phase {
        ModulePhase::Waiting => "waiting for samples",
        ModulePhase::Initialising => "initialising",
        ModulePhase::InService => "in service",
        ModulePhase::Stale => "STALE",
        ModulePhase::Other => "unknown phase",
    }
}

/// In colour; none while verdicts can be relied on.
pub(crate) fn phase_colour(phase: ModulePhase) -> Option<Colour> {
    match phase {
        ModulePhase::Waiting | ModulePhase::Initialising | ModulePhase::Other => {
            Some(Colour::Yellow)
        }
        ModulePhase::InService => None,
        ModulePhase::Stale => Some(Colour::Red),
    }
}
