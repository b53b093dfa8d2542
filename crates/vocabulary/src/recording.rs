//! Recorded samples: the publisher of a module's samples may keep the latest of them and give them
//! again, so that a diagnoser that was cut off or restarted misses nothing.
//!
//! The question travels as the parameters of a query on the very key of the samples,
//! `sample?run=7&from=a&to=b`. Each reply is one [`crate::Sample`] as it was published, oldest first;
//! samples that are no longer kept are left out.

use crate::{RunId, Step};

use crate::question::{QuestionError, in_order, required};

/// A question for samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleQuestion {
    /// The run that the steps are counted in.
    pub run: RunId,
    /// First step wanted.
    pub from: Step,
    /// Last step wanted, itself included.
    pub to: Step,
}

impl SampleQuestion {
    /// The parameters of the query.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        format!("run={}&from={}&to={}", self.run, self.from, self.to)
    }

    /// Reads the parameters of a query.
    ///
    /// # Errors
    /// A parameter missing, repeated or not a number, or steps in the wrong order.
    pub fn from_parameters(text: &str) -> Result<Self, QuestionError> {
        let run = RunId(required(text, "run")?);
        let from = Step(required(text, "from")?);
        let to = Step(required(text, "to")?);
        in_order(from, to)?;
        Ok(Self { run, from, to })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_for_samples_is_written_and_read_back() {
        let question = SampleQuestion { run: RunId(7), from: Step(3), to: Step(u64::MAX) };
        assert_eq!(SampleQuestion::from_parameters(&question.to_parameters()), Ok(question));
    }

    #[test]
    fn without_a_run_or_with_steps_in_the_wrong_order_it_is_refused() {
        let read = SampleQuestion::from_parameters;
        assert_eq!(read("from=1&to=2"), Err(QuestionError::Missing("run")));
        let backwards = QuestionError::Backwards { from: Step(3), to: Step(2) };
        assert_eq!(read("run=1&from=3&to=2"), Err(backwards));
    }
}
