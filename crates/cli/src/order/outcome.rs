//! Outcomes of commands.

use std::time::Duration;

use names::{ComponentPath, ModuleName, StructureName};
use observer::OrderError;
use serde::{Serialize, Serializer};
use wire::{FaultState, Obeyed, OrderKind};

use super::subject::Subject;
use crate::failure::Failure;
use wording::{UNTAKEN, not_saved, perhaps, printable};

/// Outcome of a command.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub(super) enum Outcome {
    /// It was carried out; whether it is in the journal.
    Obeyed { state: FaultState, sequence: u64, durable: bool },
    /// Nothing was changed.
    Refused { reason: String },
    /// It may or may not have been carried out.
    Unanswered { reason: String },
    /// Its diagnoser was not there; it was not sent.
    NotSent { reason: String },
}

/// What a command is about, for machines.
#[derive(Serialize)]
struct Named<'a> {
    module: &'a ModuleName,
    /// `null` if it is about the module.
    component: Option<&'a ComponentPath>,
}

fn named<S: Serializer>(subject: &Subject, serializer: S) -> Result<S::Ok, S::Error> {
    Named { module: subject.module(), component: subject.component() }.serialize(serializer)
}

/// A command and its outcome.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct CommandOutcome {
    pub(super) structure: Option<StructureName>,
    #[serde(flatten, serialize_with = "named")]
    pub(super) subject: Subject,
    pub(super) order: OrderKind,
    pub(super) by: String,
    #[serde(flatten)]
    pub(super) outcome: Outcome,
}

impl Outcome {
    pub(super) fn of(result: Result<Obeyed, OrderError>) -> Outcome {
        match result {
            Ok(Obeyed { state, sequence, durable, .. }) => {
                Outcome::Obeyed { state, sequence, durable }
            }
            Err(OrderError::Refused(reason)) => Outcome::Refused { reason: printable(&reason) },
            Err(OrderError::Untaken) => Outcome::Unanswered { reason: UNTAKEN.to_owned() },
            Err(error) => Outcome::Unanswered { reason: printable(&error.to_string()) },
        }
    }

    pub(super) fn not_there(within: Duration) -> Outcome {
        Outcome::NotSent { reason: format!("its diagnoser is not there (looked for {within:?})") }
    }
}

impl CommandOutcome {
    fn was_refused(&self) -> bool {
        matches!(self.outcome, Outcome::Refused { .. })
    }

    /// What went wrong, if anything did.
    fn complaint(&self) -> Option<String> {
        let (subject, module) = (&self.subject, self.subject.module());
        match &self.outcome {
            Outcome::Obeyed { durable: true, .. } => None,
            Outcome::Obeyed { durable: false, .. } => {
                Some(format!("{subject}: {}", not_saved(module.as_str())))
            }
            Outcome::Refused { reason } => Some(format!("{subject}: refused: {reason}")),
            Outcome::Unanswered { reason } => {
                Some(format!("{subject}: {}; check with `trusswatch faults`", perhaps(reason)))
            }
            Outcome::NotSent { reason } => {
                Some(format!("{subject}: {reason}; no command was sent"))
            }
        }
    }
}

/// How the command ends: silence weighs more than refusal, for it leaves open what is the case, and both weigh more
/// than what was done but not saved.
pub(super) fn conclude(outcomes: &[CommandOutcome]) -> Result<(), Failure> {
    let complaints: Vec<String> = outcomes.iter().filter_map(CommandOutcome::complaint).collect();
    let unheard = |command: &CommandOutcome| {
        matches!(command.outcome, Outcome::Unanswered { .. } | Outcome::NotSent { .. })
    };
    if complaints.is_empty() {
        Ok(())
    } else if outcomes.iter().any(unheard) {
        Err(Failure::networks(complaints))
    } else if outcomes.iter().any(CommandOutcome::was_refused) {
        Err(Failure::runtimes(complaints))
    } else {
        Err(Failure::not_saved(complaints))
    }
}
