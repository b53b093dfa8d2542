//! Whether a module's verdicts can be relied on.

use std::collections::BTreeMap;

use crate::{ComponentPath, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// The phase that a diagnoser is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ModulePhase {
    /// No sample yet.
    Waiting,
    /// Some channel cannot be judged: it rests on too few vectors, or samples are missing.
    Initialising,
    /// Every channel is watched.
    InService,
    /// Samples have stopped coming: nothing is known of the present.
    Stale,
}

impl ModulePhase {
    /// The name in messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            ModulePhase::Waiting => "waiting",
            ModulePhase::Initialising => "initialising",
            ModulePhase::InService => "in_service",
            ModulePhase::Stale => "stale",
        }
    }
}

/// A module entered another phase, or what it monitors changed: published when it happens, written to the journal, and
/// sent to clients that query the present one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PhaseChange {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Counts these messages of the module from 1, as long as its journal lasts.
    pub number: u64,
    /// The phase it is in now.
    pub phase: ModulePhase,
    /// The phase it was in before; `null` at the start of the process.
    pub before: Option<ModulePhase>,
    /// The components that it cannot monitor although it is in service, with the reason. Without a fault they are
    /// unknown. One is listed until it has been monitored again for ten seconds. Out of service it monitors none.
    pub not_monitored: BTreeMap<ComponentPath, String>,
    /// The run that the step is counted in.
    pub run: Option<RunId>,
    /// The latest step processed when it changed.
    pub step: Option<Step>,
    /// Why, in words.
    pub reason: String,
    /// When it changed \[ns since 1970\]. That a component is monitored again is published ten seconds later.
    pub time_unix_ns: u64,
}

impl Message for PhaseChange {
    const WHAT: &'static str = "change of phase";
}
