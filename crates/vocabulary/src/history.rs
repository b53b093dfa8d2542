//! What a module's journal holds: its fault transitions and what kinds of faults they are, page by page.
//!
//! The question travels as the parameters of a query, `history?since=n&limit=m`; both may be left out.

use crate::{ModuleName, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::identification::Identification;
use crate::phase::PhaseChange;
use crate::question::{QuestionError, number};
use crate::transition::FaultTransition;

/// Most transitions on a page.
pub const MAX_HISTORY_PAGE: u64 = 500;

/// A question for history.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistoryQuestion {
    /// The first sequence number wanted.
    pub since: u64,
    /// Most transitions wanted; a page has at most [`MAX_HISTORY_PAGE`].
    pub limit: u64,
}

impl HistoryQuestion {
    /// All from this sequence number on, a full page at most.
    #[must_use]
    pub fn since(since: u64) -> Self {
        Self { since, limit: MAX_HISTORY_PAGE }
    }

    /// The parameters of the query.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        format!("since={}&limit={}", self.since, self.limit)
    }

    /// Reads the parameters of a query.
    ///
    /// # Errors
    /// A parameter repeated or not a number.
    pub fn from_parameters(text: &str) -> Result<Self, QuestionError> {
        let since = number(text, "since")?.unwrap_or(1);
        let limit = number(text, "limit")?.unwrap_or(MAX_HISTORY_PAGE).clamp(1, MAX_HISTORY_PAGE);
        Ok(Self { since, limit })
    }
}

/// Most identifications of one fault on a page: the latest.
pub const MAX_IDENTIFICATIONS_OF_FAULT: usize = 32;

/// Most changes of phase on a page.
pub const MAX_PHASE_CHANGES_ON_PAGE: usize = 64;

/// A page of a module's history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HistoryPage {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Transitions in the order of their sequence numbers.
    pub transitions: Vec<FaultTransition>,
    /// The latest identifications of each fault that was declared by a transition on this page, or by one after the page
    /// before that the journal no longer holds, without signatures.
    pub identifications: Vec<Identification>,
    /// The changes of phase and of what is monitored, in their order: those in the journal after the transition before
    /// this page and before its last, or up to now if no page follows. At most the latest
    /// [`MAX_PHASE_CHANGES_ON_PAGE`].
    pub phases: Vec<PhaseChange>,
    /// The lowest sequence number that the journal still holds; `null` if it holds none.
    pub first_sequence: Option<u64>,
    /// The sequence number that the module's next transition will have.
    pub next_sequence: u64,
    /// Whether there are later transitions than those on this page.
    pub more: bool,
}

impl Message for HistoryPage {
    const WHAT: &'static str = "page of history";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_for_history_is_written_and_read_back_and_may_be_empty() {
        let question = HistoryQuestion { since: 7, limit: 3 };
        assert_eq!(HistoryQuestion::from_parameters(&question.to_parameters()), Ok(question));
        assert_eq!(HistoryQuestion::from_parameters(""), Ok(HistoryQuestion::since(1)));
        let large = HistoryQuestion::from_parameters("limit=1000000");
        assert_eq!(large, Ok(HistoryQuestion::since(1)));
    }
}
