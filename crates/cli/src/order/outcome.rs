//! Outcomes of commands.

use std::time::Duration;

use names::{ComponentPath, StructureName};
use observer::OrderError;
use serde::Serialize;
use wire::{FaultState, Obeyed, OrderKind};

use crate::failure::Failure;
use crate::wording::plain;

/// Outcome of a command.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub(super) enum Outcome {
    /// It was carried out and is in the journal.
    Obeyed { state: FaultState, sequence: u64 },
    /// Nothing was changed.
    Refused { reason: String },
    /// It may or may not have been carried out.
    Unanswered { reason: String },
    /// Its diagnoser was not there; it was not sent.
    NotSent { reason: String },
}

/// A command and its outcome.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct CommandOutcome {
    pub(super) structure: Option<StructureName>,
    pub(super) component: ComponentPath,
    pub(super) order: OrderKind,
    pub(super) by: String,
    #[serde(flatten)]
    pub(super) outcome: Outcome,
}

impl Outcome {
    pub(super) fn of(result: Result<Obeyed, OrderError>) -> Outcome {
        match result {
            Ok(Obeyed { state, sequence, .. }) => Outcome::Obeyed { state, sequence },
            Err(OrderError::Refused(reason)) => Outcome::Refused { reason: plain(&reason) },
            Err(error) => Outcome::Unanswered { reason: plain(&error.to_string()) },
        }
    }

    pub(super) fn not_there(within: Duration) -> Outcome {
        Outcome::NotSent { reason: format!("its diagnoser is not there (looked for {within:?})") }
    }
}

impl CommandOutcome {
    /// What went wrong, if anything did.
    fn complaint(&self) -> Option<String> {
        let component = &self.component;
        match &self.outcome {
            Outcome::Obeyed { .. } => None,
            Outcome::Refused { reason } => Some(format!("{component}: refused: {reason}")),
            Outcome::Unanswered { reason } => Some(format!(
                "{component}: {reason}; the command may or may not have been carried out; \
                 check with `trusswatch faults`"
            )),
            Outcome::NotSent { reason } => {
                Some(format!("{component}: {reason}; no command was sent"))
            }
        }
    }
}

/// How the command ends: silence weighs more than refusal, for it leaves open what is the case.
pub(super) fn conclude(outcomes: &[CommandOutcome]) -> Result<(), Failure> {
    let complaints: Vec<String> = outcomes.iter().filter_map(CommandOutcome::complaint).collect();
    let unheard = |command: &CommandOutcome| {
        matches!(command.outcome, Outcome::Unanswered { .. } | Outcome::NotSent { .. })
    };
    if complaints.is_empty() {
        Ok(())
    } else if outcomes.iter().any(unheard) {
        Err(Failure::networks(complaints))
    } else {
        Err(Failure::runtimes(complaints))
    }
}
