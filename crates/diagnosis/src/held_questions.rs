//! Peers' questions about steps that have not been processed yet.

use vocabulary::Step;

use crate::event::QuestionToken;
use crate::question::{Question, Refusal};
use crate::settings::Sampling;

/// Most questions held at a time.
pub(crate) const MAX_HELD_QUESTIONS: usize = 1024;
/// A question about a step this far ahead cannot be meant \[s\].
const FARTHEST_AHEAD_S: f64 = 60.0;

/// Questions waiting for their step.
#[derive(Debug, Clone)]
pub(crate) struct HeldQuestions {
    held: Vec<(QuestionToken, Question)>,
    farthest_ahead: u64,
}

impl HeldQuestions {
    pub(crate) fn new(sampling: Sampling) -> Self {
        Self { held: Vec::new(), farthest_ahead: sampling.steps(FARTHEST_AHEAD_S) }
    }

    /// Holds a question until `question.as_of` has been processed.
    ///
    /// # Errors
    /// Too many are held, or the step is too far ahead of `now`; nothing changed.
    pub(crate) fn hold(
        &mut self,
        token: QuestionToken,
        question: Question,
        now: Step,
    ) -> Result<(), Refusal> {
        if self.held.len() >= MAX_HELD_QUESTIONS {
            return Err(Refusal::TooMany(self.held.len()));
        }
        if question.as_of.since(now) > self.farthest_ahead {
            return Err(Refusal::TooFarAhead { asked: question.as_of, present: now });
        }
        self.held.push((token, question));
        Ok(())
    }

    /// Takes out the next question whose step has been processed.
    pub(crate) fn take_due(&mut self, now: Step) -> Option<(QuestionToken, Question)> {
        let due = self.held.iter().position(|(_, question)| question.as_of <= now)?;
        Some(self.held.remove(due))
    }

    /// Takes out any question.
    pub(crate) fn take_any(&mut self) -> Option<(QuestionToken, Question)> {
        self.held.pop()
    }

    pub(crate) fn withdraw(&mut self, token: QuestionToken) {
        self.held.retain(|(held, _)| *held != token);
    }

    pub(crate) fn len(&self) -> usize {
        self.held.len()
    }
}
