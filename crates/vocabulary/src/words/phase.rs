//! Phases of modules.

use crate::ModulePhase;

/// In words.
#[must_use]
pub fn phase_in_words(phase: ModulePhase) -> &'static str {
    match phase {
        ModulePhase::Waiting => "waiting for samples",
        ModulePhase::Initialising => "initialising",
        ModulePhase::InService => "in service",
        ModulePhase::Stale => "STALE",
    }
}
