//! A case step by step, in words: what changed, which module asked which peer, and the reason
//! for each verdict.

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

/// What a line reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LineKind {
    /// What the run is.
    Setting,
    /// Every channel is watched from here on.
    Watching,
    /// A fault began.
    Injected,
    /// A fault ended.
    Repaired,
    /// A diagnoser gets no samples, or is restarted.
    Gap,
    /// A channel changed.
    Change,
    /// A module asked a peer.
    Asked,
    /// The peer answered.
    Answered,
    /// A change was explained by another component's fault.
    Explained,
    /// A component was named as faulty.
    Fault,
    /// A change could not be judged.
    Unconfirmed,
    /// What the comparison with a reference says of a component.
    Condition,
    /// What a fault may be.
    Identified,
    /// Several alike, in short.
    More,
    /// What came of the run.
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
    /// When it happened \[s\].
    pub time_s: f64,
    /// At which step it happened.
    pub step: Step,
    /// What it reports.
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

/// A case in words.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseExplanation<R> {
    /// What happened, in order.
    pub lines: Vec<StoryLine>,
    /// What came of it.
    pub row: R,
}

/// One line each, each with its end.
impl<R> fmt::Display for CaseExplanation<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines.iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

/// Runs a case once more and reports what happens.
///
/// # Errors
/// A plant or diagnosers that cannot be made.
pub fn explain<C: Campaign>(
    campaign: &C,
    number: u64,
    engine: &Engine,
) -> Result<CaseExplanation<C::Row>, StudyError> {
    let (account, row) = Account::take(campaign, number, engine)?;
    Ok(CaseExplanation { lines: CaseStory::new(&account).render(), row })
}
