//! Outcomes of commands.

use observer::OrderOutcome;
use serde::{Serialize, Serializer};
use vocabulary::{ComponentPath, ModuleName, OrderKind, StructureName};

use super::subject::Subject;
use crate::failure::Failure;

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
    pub(super) outcome: OrderOutcome,
}

impl CommandOutcome {
    /// In words.
    pub(super) fn words(&self) -> String {
        let words = self.outcome.words(self.order, &self.subject.to_string());
        let is_unanswered = matches!(self.outcome, OrderOutcome::Unanswered { .. });
        if is_unanswered { format!("{words}; check with `trusswatch faults`") } else { words }
    }
}

/// How the command ends: silence weighs more than refusal, for it leaves open what is the case, and both weigh more
/// than what was done but not saved.
pub(super) fn conclude(outcomes: &[CommandOutcome]) -> Result<(), Failure> {
    let failed = || outcomes.iter().filter(|command| !command.outcome.is_done());
    let complaints: Vec<String> = failed().map(CommandOutcome::words).collect();
    let is_unheard = |command: &CommandOutcome| {
        matches!(command.outcome, OrderOutcome::Unanswered { .. } | OrderOutcome::NotSent { .. })
    };
    let is_refused =
        |command: &CommandOutcome| matches!(command.outcome, OrderOutcome::Refused { .. });
    if complaints.is_empty() {
        Ok(())
    } else if failed().any(is_unheard) {
        Err(Failure::networks(complaints))
    } else if failed().any(is_refused) {
        Err(Failure::runtimes(complaints))
    } else {
        Err(Failure::not_saved(complaints))
    }
}
