//! A command to a module, and how a question or a command ended.

use std::time::Duration;

use serde::Serialize;
use vocabulary::words::{Tone, UNTAKEN, done, not_saved, perhaps, printable};
use vocabulary::{
    FaultState, Key, ModuleName, Obeyed, OperatorName, Order, OrderKind, StructureName, Topic,
};

/// Why a question or an order did not end with an answer that one can use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum QueryError {
    /// Refused; nothing was changed.
    #[error("refused: {0}")]
    Refused(String),
    /// No answer in time; perhaps there is no such process, perhaps a command was carried out.
    #[error("no answer within {0:?}")]
    Unanswered(Duration),
    /// The network ended a command at once, without an answer: no process takes commands on its key, access control does
    /// not admit it, or the process that took it has just ended.
    #[error("no process accepted the command")]
    Untaken,
    /// The question was not put, for this reason.
    #[error("{0}")]
    NotAsked(String),
    /// The answer makes no sense, or the question could not be put.
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
    /// What is ordered.
    pub kind: OrderKind,
    /// The operator whose certificate the session shows: access control admits no other to his keys. Without one the
    /// message itself says who it is.
    pub operator: Option<OperatorName>,
    /// The message.
    pub order: Order,
}

impl OrderRequest {
    /// Where it is sent.
    pub(crate) fn key(&self) -> Key {
        let topic = match &self.operator {
            Some(operator) => Topic::CommandOf(self.kind, operator.clone()),
            None => Topic::Command(self.kind),
        };
        Key::of_module(&self.structure, &self.module, topic)
    }

    /// The component or the module that it is about.
    #[must_use]
    pub fn subject(&self) -> String {
        let Self { module, order, .. } = self;
        order
            .component
            .as_ref()
            .map_or_else(|| module.to_string(), |mention| format!("{module}/{}", mention.component))
    }
}

/// How a command to a module ended.
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

    /// How it is coloured.
    #[must_use]
    pub fn tone(&self) -> Tone {
        if self.is_done() { Tone::Calm } else { Tone::Alarm }
    }

    /// In words: of a command of this kind about this component or module.
    #[must_use]
    pub fn words(&self, kind: OrderKind, subject: &str) -> String {
        let words = match self {
            Self::Obeyed { state, sequence, durable: true } if kind.is_about_verdict() => {
                format!("{}: now {state}, transition {sequence}", done(kind))
            }
            Self::Obeyed { sequence, durable: true, .. } => {
                format!("{}: transition {sequence}", done(kind))
            }
            Self::Obeyed { .. } => not_saved(subject.split('/').next().unwrap_or(subject)),
            Self::Refused { reason } => format!("refused: {reason}"),
            Self::Unanswered { reason } => perhaps(reason),
            Self::NotSent { reason } => format!("{reason}; no command was sent"),
        };
        format!("{subject}: {words}")
    }
}
