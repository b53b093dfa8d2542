//! Peers' questions: held until their step has been processed, then answered.

use vocabulary::{Component, ModuleName, RunId, Step};

use crate::channels::Channels;
use crate::event::{Action, QuestionToken};
use crate::held_questions::HeldQuestions;
use crate::intake::Intake;
use crate::judging::Judging;
use crate::question::{Answer, Question, Refusal};
use crate::settings::Sampling;
use vocabulary::{ActuatorFault, Counters};

/// The questions of peers that wait for their step.
#[derive(Debug, Clone)]
pub(crate) struct Answering {
    held: HeldQuestions,
}

/// What answers are made of.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Knowledge<'a> {
    pub(crate) module: &'a ModuleName,
    pub(crate) intake: &'a Intake,
    pub(crate) channels: &'a Channels,
    pub(crate) judging: &'a Judging,
}

impl Answering {
    pub(crate) fn new(sampling: Sampling) -> Self {
        Self { held: HeldQuestions::new(sampling) }
    }

    pub(crate) fn len(&self) -> usize {
        self.held.len()
    }

    /// The asker no longer waits.
    pub(crate) fn withdraw(&mut self, token: QuestionToken) {
        self.held.withdraw(token);
    }

    /// Takes a question: answers, holds or refuses it.
    pub(crate) fn take(
        &mut self,
        (token, question): (QuestionToken, Question),
        knowledge: Knowledge,
        counters: &mut Counters,
        actions: &mut Vec<Action>,
    ) {
        let held = match knowledge.intake.position() {
            Some((run, _)) if run != question.run => {
                Err(Refusal::OtherRun { asked: question.run, present: run })
            }
            Some((_, now)) => self.held.hold(token, question, now),
            None if knowledge.reaches(&question) => {
                counters.answers_given += 1;
                actions.push(Action::Answer { token, answer: knowledge.answer(question) });
                return;
            }
            None => Err(Refusal::NoSample),
        };
        match held {
            Err(refusal) => refuse(token, refusal, counters, actions),
            Ok(()) => self.answer_due(knowledge, counters, actions),
        }
    }

    /// Answers every question whose step has been processed.
    pub(crate) fn answer_due(
        &mut self,
        knowledge: Knowledge,
        counters: &mut Counters,
        actions: &mut Vec<Action>,
    ) {
        let Some(now) = knowledge.intake.last_step() else { return };
        while let Some((token, question)) = self.held.take_due(now) {
            counters.answers_given += 1;
            actions.push(Action::Answer { token, answer: knowledge.answer(question) });
        }
    }

    /// Refuses every question about a run that has ended.
    pub(crate) fn end_run(
        &mut self,
        present: RunId,
        counters: &mut Counters,
        actions: &mut Vec<Action>,
    ) {
        while let Some((token, question)) = self.held.take_any() {
            let refusal = Refusal::OtherRun { asked: question.run, present };
            refuse(token, refusal, counters, actions);
        }
    }
}

fn refuse(
    token: QuestionToken,
    refusal: Refusal,
    counters: &mut Counters,
    actions: &mut Vec<Action>,
) {
    counters.questions_refused += 1;
    actions.push(Action::Refuse { token, refusal });
}

impl Knowledge<'_> {
    /// Can the question be answered from before a restart?
    fn reaches(&self, question: &Question) -> bool {
        self.intake.recalled_run() == Some(question.run)
            && self.channels.coverage().since(question.as_of).is_some()
    }

    /// What this module has to say as of a step that it has processed.
    fn answer(&self, question: Question) -> Answer {
        let Question { run, from, as_of, window } = question;
        let changes = self.judging.isolator().changes_as_of(from, as_of);
        let ledger = self.judging.ledger();
        let faults = ledger.faulty(self.module, run);
        let in_time = faults.filter(|(_, since)| since.found <= as_of);
        let actuator_faults = in_time.filter_map(|(path, since)| match path.component {
            Component::Actuator(actuator) => Some(ActuatorFault { actuator, step: since.change }),
            Component::Sensor(_) => None,
        });
        Answer {
            question,
            watching_since: self.watching_since(as_of),
            changes: changes.collect(),
            actuator_faults: actuator_faults.collect(),
            alarms: ledger.alarms(run, as_of),
            window: window.and_then(|length| self.channels.window_ended_at(length, as_of)).cloned(),
        }
    }

    fn watching_since(&self, as_of: Step) -> Option<Step> {
        let since = self.channels.coverage().since(as_of)?;
        Some(since.max(self.judging.isolator().log().known_from()))
    }
}
