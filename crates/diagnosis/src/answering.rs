//! Peers' questions: held until their step has been processed, then answered.

use vocabulary::{Component, RunId, Step};

use crate::diagnoser::Diagnoser;
use crate::event::{Action, QuestionToken};
use crate::question::Refusal;
use vocabulary::{ActuatorFault, StateAnswer, StateQuestion};

/// Most questions held at a time.
const MAX_HELD_QUESTIONS: usize = 1024;
/// A question about a step this far ahead cannot be meant \[s\].
const FARTHEST_AHEAD_S: f64 = 60.0;

impl Diagnoser {
    /// Takes a question: answers, holds or refuses it.
    pub(crate) fn take_question(
        &mut self,
        token: QuestionToken,
        question: StateQuestion,
        actions: &mut Vec<Action>,
    ) {
        let refusal = match self.intake.position() {
            Some((present, _)) if present != question.run => {
                Refusal::OtherRun { asked: question.run, present }
            }
            Some(_) if self.held.len() >= MAX_HELD_QUESTIONS => Refusal::TooMany(self.held.len()),
            Some((_, present))
                if question.as_of.since(present) > self.sampling.steps(FARTHEST_AHEAD_S) =>
            {
                Refusal::TooFarAhead { asked: question.as_of, present }
            }
            Some((_, now)) => {
                self.held.push((token, question));
                return self.answer_due(now, actions);
            }
            None if self.was_watching(&question) => {
                return self.give_answer(token, question, actions);
            }
            None => Refusal::NoSample,
        };
        self.refuse(token, refusal, actions);
    }

    /// Answers every question whose step has been processed.
    pub(crate) fn answer_due(&mut self, now: Step, actions: &mut Vec<Action>) {
        while let Some(due) = self.held.iter().position(|(_, question)| question.as_of <= now) {
            let (token, question) = self.held.remove(due);
            self.give_answer(token, question, actions);
        }
    }

    /// Refuses every question about a run that has ended.
    pub(crate) fn refuse_held(&mut self, present: RunId, actions: &mut Vec<Action>) {
        while let Some((token, question)) = self.held.pop() {
            let refusal = Refusal::OtherRun { asked: question.run, present };
            self.refuse(token, refusal, actions);
        }
    }

    fn refuse(&mut self, token: QuestionToken, refusal: Refusal, actions: &mut Vec<Action>) {
        self.counters.questions_refused += 1;
        actions.push(Action::Refuse { token, refusal });
    }

    fn give_answer(
        &mut self,
        token: QuestionToken,
        question: StateQuestion,
        actions: &mut Vec<Action>,
    ) {
        self.counters.answers_given += 1;
        actions.push(Action::Answer { token, answer: self.answer(question) });
    }

    /// Can the question be answered from before a restart?
    fn was_watching(&self, question: &StateQuestion) -> bool {
        self.intake.recalled_run() == Some(question.run)
            && self.channels.coverage().since(question.as_of).is_some()
    }

    /// What this module has to say as of a step that it has processed.
    fn answer(&self, question: StateQuestion) -> StateAnswer {
        let StateQuestion { run, from, as_of, window } = question;
        let (isolator, ledger) = (&self.judging.isolator, &self.judging.ledger);
        let faults = ledger.faulty(run).filter(|(_, since)| since.found <= as_of);
        let actuator_faults = faults.filter_map(|(path, since)| match path.component {
            Component::Actuator(actuator) => Some(ActuatorFault { actuator, step: since.change }),
            Component::Sensor(_) => None,
        });
        let watching_since = self.channels.coverage().since(as_of);
        StateAnswer {
            module: self.module.clone(),
            question,
            watching_since: watching_since.map(|since| since.max(isolator.log.known_from())),
            changes: isolator.changes_as_of(from, as_of).collect(),
            actuator_faults: actuator_faults.collect(),
            alarms: ledger.alarms(run, as_of),
            pending: ledger.pending(run, as_of),
            window: window.and_then(|length| self.channels.window_ended_at(length, as_of)).cloned(),
        }
    }
}
