//! A command to a module, and the outcomes of questions and commands.

use std::time::Duration;

use serde::Serialize;
use vocabulary::words::{Tone, UNTAKEN, done, not_saved, perhaps, printable};
use vocabulary::{
    FaultState, Key, ModuleName, Obeyed, OperatorName, Order, OrderKind, StructureName, Topic,
};

/// Why a question or an order did not get a usable answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum QueryError {
    /// Refused; nothing was changed.
    #[error("refused: {0}")]
    Refused(String),
    /// No answer in time: there may be no such process, or a command may have been carried out.
    #[error("no answer within {0:?}")]
    Unanswered(Duration),
    /// Zenoh ended the command at once without an answer: no process accepts commands on its key, access control denies
    /// it, or the process that accepted it has just stopped.
    #[error("no process accepted the command")]
    Untaken,
    /// The question was not sent, for this reason.
    #[error("{0}")]
    NotAsked(String),
    /// The answer is invalid, or the question could not be encoded.
    #[error("invalid answer: {0}")]
    Senseless(String),
}

/// A command to a module's diagnoser, about the module or one of its components.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderRequest {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The kind of order.
    pub kind: OrderKind,
    /// The operator in the session's certificate: access control denies commands on the keys of other operators.
    /// Without a certificate the message names the issuer.
    pub operator: Option<OperatorName>,
    /// The message.
    pub order: Order,
}

impl OrderRequest {
    /// The key that it is sent on.
    #[must_use]
    pub fn key(&self) -> Key {
        let topic = match &self.operator {
            Some(operator) => Topic::CommandOf(self.kind, operator.clone()),
            None => Topic::Command(self.kind),
        };
        Key::of_module(&self.structure, &self.module, topic)
    }

    /// The component or module that it is about.
    #[must_use]
    pub fn subject(&self) -> String {
        order_subject(&self.module, &self.order)
    }
}

/// The component or module that an order to this module is about.
#[must_use]
pub fn order_subject(module: &ModuleName, order: &Order) -> String {
    let component = order.component.as_ref().map(|mention| &mention.component);
    component.map_or_else(|| module.to_string(), |component| format!("{module}/{component}"))
}

/// The outcome of a command to a module.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum OrderOutcome {
    /// It was carried out.
    Obeyed {
        /// The state of the component, or of one component of the module.
        state: FaultState,
        /// The number of the transition.
        sequence: u64,
        /// Whether it is in the journal.
        durable: bool,
    },
    /// Nothing was changed.
    Refused {
        /// Why, printable.
        reason: String,
    },
    /// It may or may not have been carried out.
    Unanswered {
        /// Why, printable.
        reason: String,
    },
    /// It was not sent.
    NotSent {
        /// Why, printable.
        reason: String,
    },
}

impl From<Result<Obeyed, QueryError>> for OrderOutcome {
    fn from(result: Result<Obeyed, QueryError>) -> Self {
        match result {
            Ok(Obeyed { state, sequence, durable, .. }) => {
                Self::Obeyed { state, sequence, durable }
            }
            Err(QueryError::Refused(reason)) => Self::Refused { reason: printable(&reason) },
            Err(QueryError::Untaken) => Self::Unanswered { reason: UNTAKEN.to_owned() },
            Err(error) => Self::Unanswered { reason: printable(&error.to_string()) },
        }
    }
}

impl OrderOutcome {
    /// It was not sent, for this reason.
    #[must_use]
    pub fn not_sent(reason: &str) -> Self {
        Self::NotSent { reason: printable(reason) }
    }

    /// Whether it was carried out and is in the journal.
    #[must_use]
    pub fn is_done(&self) -> bool {
        matches!(self, Self::Obeyed { durable: true, .. })
    }

    /// Its colour.
    #[must_use]
    pub fn tone(&self) -> Tone {
        if self.is_done() { Tone::Calm } else { Tone::Alarm }
    }

    /// What it led to, if it was carried out.
    #[must_use]
    pub fn effect(&self, kind: OrderKind, subject: &str) -> Option<String> {
        let Self::Obeyed { state, sequence, .. } = self else { return None };
        Some(match subject.contains('/') {
            true if kind.is_about_verdict() => format!("now {state}, transition {sequence}"),
            true => format!("transition {sequence}"),
            // The state is that of one of the module's components.
            false => format!("up to transition {sequence}"),
        })
    }

    /// The outcome in words, for a command of this kind about this component or module.
    #[must_use]
    pub fn words(&self, kind: OrderKind, subject: &str) -> String {
        let words = match self {
            Self::Obeyed { durable: true, .. } => {
                format!("{}: {}", done(kind), self.effect(kind, subject).unwrap_or_default())
            }
            Self::Obeyed { .. } => not_saved(subject.split('/').next().unwrap_or(subject)),
            Self::Refused { reason } => format!("refused: {reason}"),
            Self::Unanswered { reason } => perhaps(reason),
            Self::NotSent { reason } => format!("{reason}; no command was sent"),
        };
        format!("{subject}: {words}")
    }
}
