//! What became of orders.

use std::time::Duration;

use daemon::observer::OrderError;
use serde::Serialize;
use truss::ids::{ComponentPath, StructureName};
use wire::{FaultState, Obeyed, OrderKind};

use crate::failure::Failure;
use crate::telling::plain;

/// What became of an order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub(super) enum Outcome {
    /// It was carried out and is in the journal.
    Obeyed { state: FaultState, sequence: u64 },
    /// Nothing was changed.
    Refused { reason: String },
    /// It may or may not have been carried out.
    Unanswered { reason: String },
    /// There was nobody to give it to; it was not sent.
    NotSent { reason: String },
}

/// An order and what became of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Told {
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

impl Told {
    /// What went wrong, if anything did.
    fn complaint(&self) -> Option<String> {
        let component = &self.component;
        match &self.outcome {
            Outcome::Obeyed { .. } => None,
            Outcome::Refused { reason } => Some(format!("{component}: refused: {reason}")),
            Outcome::Unanswered { reason } => Some(format!(
                "{component}: {reason}; the order may or may not have been carried out, \
                 `trusswatch faults` tells"
            )),
            Outcome::NotSent { reason } => {
                Some(format!("{component}: {reason}; nothing was ordered"))
            }
        }
    }
}

/// How the command ends: silence weighs more than refusal, for it leaves open what is the case.
pub(super) fn conclude(told: &[Told]) -> Result<(), Failure> {
    let complaints: Vec<String> = told.iter().filter_map(Told::complaint).collect();
    let unheard =
        |told: &Told| matches!(told.outcome, Outcome::Unanswered { .. } | Outcome::NotSent { .. });
    if complaints.is_empty() {
        Ok(())
    } else if told.iter().any(unheard) {
        Err(Failure::networks(complaints))
    } else {
        Err(Failure::runtimes(complaints))
    }
}
