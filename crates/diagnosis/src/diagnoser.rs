//! One module's diagnoser: samples, questions and answers in, actions out.
//!
//! Data flows one way: sample ([`Intake`]) → residuals → divergences → changes ([`Channels`]) → judgements →
//! transitions ([`Judging`]); peers' questions are answered from these ([`Answering`]). The order of the
//! actions is the order in which they are to be carried out.

use vocabulary::{Component, ModuleName, ModulePhase, RunId, Step};

use crate::answering::{Answering, Knowledge};
use crate::channels::Channels;
use crate::commands::Commands;
use crate::comparing::Comparing;
use crate::coverage::Coverage;
use crate::event::{Action, Event, QuestionToken};
use crate::freeze::Freezing;
use crate::identifying::Identifying;
use crate::intake::{Admission, Intake};
use crate::judging::Judging;
use crate::memory::Memory;
use crate::order::{Order, OrderToken};
use crate::question::{Answer, Question};
use crate::sample::Sample;
use crate::settings::{ModuleSetup, SetupError};
use crate::state::{Condition, WindowLength, WindowMeans};
use crate::verdict::Transition;
use vocabulary::{Counters, Evidence, Verdict};

/// The diagnoser of one module.
#[derive(Debug, Clone)]
pub struct Diagnoser {
    module: ModuleName,
    peers: Vec<ModuleName>,
    intake: Intake,
    channels: Channels,
    judging: Judging,
    answering: Answering,
    comparing: Comparing,
    identifying: Identifying,
    freezing: Freezing,
    counters: Counters,
}

impl Diagnoser {
    /// A diagnoser that has seen nothing yet.
    ///
    /// # Errors
    /// Everything in the setup that cannot be right.
    pub fn new(setup: ModuleSetup) -> Result<Self, Vec<SetupError>> {
        let problems = setup.problems();
        if !problems.is_empty() {
            return Err(problems);
        }
        let channels = Channels::new(&setup)?;
        Ok(Self {
            intake: Intake::new(channels.components(), setup.sampling()),
            judging: Judging::new(&setup, channels.components()),
            channels,
            answering: Answering::new(setup.sampling()),
            comparing: Comparing::new(&setup),
            identifying: Identifying::new(&setup),
            freezing: Freezing::new(&setup),
            counters: Counters::default(),
            module: setup.module,
            peers: setup.peers,
        })
    }

    /// Takes up what was known before a restart; to be called before the first event.
    pub fn recall(&mut self, memory: Memory) {
        let Memory { sequence, latest, watch } = memory;
        for transition in &latest {
            if let Some((channel, tare)) =
                self.channels.position(&transition.component).zip(transition.tare)
            {
                self.channels.shift_tare(channel, tare);
            }
        }
        self.judging.recall_verdicts(sequence, latest);
        self.identifying.recall(self.judging.ledger());
        let Some(past) = watch else { return };
        self.intake.recall(past.run);
        if let Some((since, until)) = past.watched {
            self.channels.recall(Coverage::recalled(since, until));
        }
        self.judging.recall_changes(&past, &self.channels);
    }

    /// D/γ of a channel, less what a cylinder's demand explains of it: by this ties are decided and jumps recognised.
    #[must_use]
    pub fn excess(&self, channel: usize) -> f64 {
        self.channels.excess(channel)
    }

    /// Takes an event; appends what is to be done.
    pub fn handle(&mut self, event: Event, actions: &mut Vec<Action>) {
        let before = actions.len();
        match event {
            Event::Sample(sample) => return self.take_sample(&sample, actions),
            Event::Asked { token, question } => self.take_question(token, question, actions),
            Event::Withdrawn { token } => self.answering.withdraw(token),
            Event::Answered { peer, answer } => self.take_answer(&peer, answer, actions),
            Event::Unanswered { peer, question, .. } => {
                self.take_silence(&peer, question, actions);
            }
            Event::Returned { peer } => self.take_return(&peer, actions),
            Event::Ordered { token, order } => self.take_order(token, order, actions),
        }
        self.freezing.note(&actions[before..]);
    }

    /// No sample follows for now: what was seen of the latest faults is given as far as it goes ([`Action::Freeze`]).
    pub fn end_freeze_frames(&mut self, actions: &mut Vec<Action>) {
        self.freezing.end(&self.channels, actions);
    }

    /// Takes a sample without taking ownership of it; otherwise like [`Event::Sample`].
    pub fn take_sample(&mut self, sample: &Sample, actions: &mut Vec<Action>) {
        let before = actions.len();
        match self.intake.admit(sample) {
            Ok(Admission::First { ended }) => self.begin_run(sample.run, ended, actions),
            Ok(Admission::Following { missing: 0, .. }) => {}
            Ok(Admission::Following { last, missing }) => {
                self.counters.samples_missing += missing;
                self.channels.bridge(last, missing);
                actions.push(Action::Gap { from: last.plus(1), missing });
            }
            Err(rejection) => {
                rejection.count_in(&mut self.counters);
                actions.push(Action::Rejected { step: sample.step, rejection });
                return;
            }
        }
        self.counters.samples += 1;
        let now = (sample.run, sample.step);
        self.channels.observe(sample);
        self.counters.samples_non_finite += u64::from(self.channels.is_incomplete());
        for &occurrence in self.channels.occurrences() {
            self.judging.note(occurrence, now, &self.channels, &mut self.counters, actions);
        }
        self.judging.follow(now, &self.channels, actions);
        actions.extend(self.channels.update_phase(sample.step));
        self.judge(now, actions);
        self.compare(now, actions);
        self.identifying.follow(now, &self.channels, &self.judging, actions);
        self.freezing.note(&actions[before..]);
        self.freezing.follow(sample.step, &self.channels, actions);
        self.answer_due(actions);
    }

    /// Forgets everything but what is latched or can never be judged. A run that goes on after a restart
    /// forgets nothing.
    fn begin_run(&mut self, run: RunId, ended: Option<Step>, actions: &mut Vec<Action>) {
        self.counters.runs += 1;
        actions.extend(ended.map(|_| Action::RunEnded));
        actions.push(Action::RunStarted(run));
        if let Some(last) = ended {
            self.end_freeze_frames(actions);
            self.channels.end_run();
            self.comparing.restart();
            self.identifying.restart();
            self.answering.end_run(run, &mut self.counters, actions);
            self.judging.end_run(self.channels.components().len(), last, actions);
        }
        actions.push(self.channels.begin_run());
    }

    fn judge(&mut self, now: (RunId, Step), actions: &mut Vec<Action>) {
        self.judging.judge(now, &self.channels, &mut self.counters, actions);
    }

    /// Compares the windows that ended at this step with the reference.
    fn compare(&mut self, now: (RunId, Step), actions: &mut Vec<Action>) {
        let Self { channels, judging, comparing, counters, .. } = self;
        comparing.compare(now, channels, judging, counters, actions);
    }

    fn take_answer(&mut self, peer: &ModuleName, answer: Answer, actions: &mut Vec<Action>) {
        let Some(now) = self.intake.position() else { return };
        if answer.question.window.is_some() {
            let Self { channels, judging, comparing, counters, .. } = self;
            let question = answer.question;
            let answered = (peer, question, Some(answer));
            return comparing.answered(answered, channels, judging, counters, actions);
        }
        let (channels, counters) = (&self.channels, &mut self.counters);
        self.judging.answered((peer, answer), now, channels, counters, actions);
        self.judge(now, actions);
    }

    fn take_silence(&mut self, peer: &ModuleName, question: Question, actions: &mut Vec<Action>) {
        let Some(now) = self.intake.position() else { return };
        if question.window.is_some() {
            let Self { channels, judging, comparing, counters, .. } = self;
            counters.questions_unanswered += 1;
            let answered = (peer, question, None);
            return comparing.answered(answered, channels, judging, counters, actions);
        }
        if self.judging.unanswered(peer, question, now.1, &mut self.counters) {
            self.judge(now, actions);
        }
    }

    fn take_return(&mut self, peer: &ModuleName, actions: &mut Vec<Action>) {
        let Some(now) = self.intake.position() else { return };
        self.judging.returned(peer, now.1);
        self.judge(now, actions);
    }

    fn take_order(&mut self, token: OrderToken, order: Order, actions: &mut Vec<Action>) {
        let now = self.intake.last_step().unwrap_or_default();
        let mut commands = Commands {
            channels: &mut self.channels,
            judging: &mut self.judging,
            comparing: &mut self.comparing,
            run: self.intake.run(),
            now,
        };
        match commands.carry_out(order, actions) {
            Ok(sequence) => actions.push(Action::Obeyed { token, sequence }),
            Err(refusal) => actions.push(Action::OrderRefused { token, refusal }),
        }
    }

    fn take_question(
        &mut self,
        token: QuestionToken,
        question: Question,
        actions: &mut Vec<Action>,
    ) {
        let Self { module, intake, channels, judging, answering, counters, .. } = self;
        let knowledge = Knowledge { module, intake, channels, judging };
        answering.take((token, question), knowledge, counters, actions);
    }

    fn answer_due(&mut self, actions: &mut Vec<Action>) {
        let Self { module, intake, channels, judging, answering, counters, .. } = self;
        answering.answer_due(Knowledge { module, intake, channels, judging }, counters, actions);
    }

    /// The phase.
    #[must_use]
    pub fn phase(&self) -> ModulePhase {
        self.channels.phase()
    }

    /// Since which step every channel is watched, if the module is in service.
    #[must_use]
    pub fn in_service_since(&self) -> Option<Step> {
        self.channels.in_service_since()
    }

    /// What was counted.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// The module.
    #[must_use]
    pub fn module(&self) -> &ModuleName {
        &self.module
    }

    /// The peers that are asked.
    #[must_use]
    pub fn peers(&self) -> &[ModuleName] {
        &self.peers
    }

    /// The run being diagnosed.
    #[must_use]
    pub fn run(&self) -> Option<RunId> {
        self.intake.run()
    }

    /// The latest step processed.
    #[must_use]
    pub fn last_step(&self) -> Option<Step> {
        self.intake.last_step()
    }

    /// The channels: actuators, then gages, in the order of the description.
    #[must_use]
    pub fn components(&self) -> &[Component] {
        self.channels.components()
    }

    /// Each channel at the latest step.
    #[must_use]
    pub fn evidence(&self) -> &[Evidence] {
        self.channels.evidence()
    }

    /// The means over the window of this length that ended at the latest step, if one did.
    #[must_use]
    pub fn window(&self, length: WindowLength) -> Option<&WindowMeans> {
        self.channels.window(length)
    }

    /// The condition of each component, in the order of [`Diagnoser::components`].
    pub fn conditions(&self) -> impl Iterator<Item = &Condition> {
        (0..self.channels.components().len()).map(|channel| self.comparing.condition(channel))
    }

    /// The verdict on each component.
    pub fn verdicts(&self) -> impl Iterator<Item = (&Component, &Verdict)> {
        self.judging.ledger().verdicts()
    }

    /// The latest transition of a component, if it ever had one.
    #[must_use]
    pub fn last_transition(&self, component: &Component) -> Option<&Transition> {
        self.judging.ledger().latest(component)
    }

    /// The latest transition of each component that ever had one.
    pub fn last_transitions(&self) -> impl Iterator<Item = &Transition> {
        self.judging.ledger().transitions()
    }

    /// The number that the next transition will have.
    #[must_use]
    pub fn next_sequence(&self) -> u64 {
        self.judging.ledger().next_sequence()
    }

    /// Peers' questions that wait for their step.
    #[must_use]
    pub fn waiting_questions(&self) -> usize {
        self.answering.len()
    }
}
