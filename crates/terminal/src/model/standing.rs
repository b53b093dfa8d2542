//! Whether a module can be relied on at present.

use observer::LiveModule;
use wire::ModulePhase;
use wording::{Tone, phase_in_words, phase_tone};

/// How a module stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It is not heard any more since then \[ns since 1970\]; 0 if it never was.
    Silent(u64),
    /// It is heard, but does not report its components.
    NotAnswering,
    /// What it says of itself.
    Phase(ModulePhase),
    /// It is heard, but has not said how it is.
    Unstated,
}

impl Standing {
    pub(crate) fn of(module: &LiveModule) -> Self {
        if let Some(since) = module.silent_since_unix_ns {
            return Self::Silent(since);
        }
        if !module.picture.answers() {
            return Self::NotAnswering;
        }
        module.picture.member.phase().map_or(Self::Unstated, Self::Phase)
    }

    /// Whether what it says of its components holds now.
    pub(crate) fn is_reliable(self) -> bool {
        self == Self::Phase(ModulePhase::InService)
    }

    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::Silent(_) => "SILENT",
            Self::NotAnswering => "NOT ANSWERING",
            Self::Phase(phase) => phase_in_words(phase),
            Self::Unstated => "unknown phase",
        }
    }

    pub(crate) fn tone(self) -> Tone {
        match self {
            Self::Silent(_) | Self::NotAnswering => Tone::Alarm,
            Self::Phase(phase) => phase_tone(phase),
            Self::Unstated => Tone::Doubt,
        }
    }
}
