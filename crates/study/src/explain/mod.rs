//! Explains a case step by step in words: which channels changed, which module queried which peer, and the reason for
//! each verdict.

mod account;
mod outcome;
mod reason;
mod story;
mod words;

use std::fmt;

use vocabulary::Step;

use crate::campaign::Campaign;
use crate::engine::Engine;
use crate::error::StudyError;

use account::Account;
use story::CaseStory;

/// The event that a line reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LineKind {
    /// The run and its conditions.
    Setting,
    /// Every channel is watched from here on.
    Watching,
    /// A fault began.
    Injected,
    /// A fault ended.
    Repaired,
    /// A diagnoser receives no samples, or is restarted.
    Gap,
    /// A channel changed.
    Change,
    /// A module queried a peer.
    Asked,
    /// The peer answered.
    Answered,
    /// A change was explained by another component's fault.
    Explained,
    /// A component was named as faulty.
    Fault,
    /// A change could not be judged.
    Unconfirmed,
    /// The comparison of a component with its reference.
    Condition,
    /// The identification of a fault.
    Identified,
    /// A summary of similar events.
    More,
    /// The result of the run.
    Outcome,
    /// Why the outcome is not exact.
    Because,
}

impl LineKind {
    /// A word for the margin.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            LineKind::Setting => "case",
            LineKind::Watching => "watching",
            LineKind::Injected => "INJECT",
            LineKind::Repaired => "REPAIR",
            LineKind::Gap => "gap",
            LineKind::Change => "change",
            LineKind::Asked => "asked",
            LineKind::Answered => "answered",
            LineKind::Explained => "explained",
            LineKind::Fault => "FAULT",
            LineKind::Unconfirmed => "open",
            LineKind::Condition => "condition",
            LineKind::Identified => "kind",
            LineKind::More => "more",
            LineKind::Outcome => "outcome",
            LineKind::Because => "because",
        }
    }
}

/// One line of an explanation.
#[derive(Debug, Clone, PartialEq)]
pub struct StoryLine {
    /// The time of the event \[s\].
    pub time_s: f64,
    /// The step of the event.
    pub step: Step,
    /// The event.
    pub kind: LineKind,
    /// The words, without a line break.
    pub text: String,
}

/// `10.836 s  change     module1/actuator/a3, divergence …`
impl fmt::Display for StoryLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let StoryLine { time_s, kind, text, .. } = self;
        write!(f, "{time_s:>7.3} s  {:<9}  {text}", kind.as_str())
    }
}

/// The explanation of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseExplanation<R> {
    /// The events, in order.
    pub lines: Vec<StoryLine>,
    /// The result of the case.
    pub row: R,
}

/// One line each, each with its end.
impl<R> fmt::Display for CaseExplanation<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines.iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

/// Runs a case again and reports its events.
///
/// # Errors
/// A plant or diagnosers cannot be created.
pub fn explain<C: Campaign>(
    campaign: &C,
    number: u64,
    engine: &Engine,
) -> Result<CaseExplanation<C::Row>, StudyError> {
    let (account, row) = Account::take(campaign, number, engine)?;
    Ok(CaseExplanation { lines: CaseStory::new(&account).render(), row })
}
