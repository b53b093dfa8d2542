//! One module's diagnoser: samples, questions and answers in, actions out.
//!
//! Data flows one way: sample ([`Intake`]) → residuals → divergences → changes ([`Channels`]) → judgements →
//! transitions ([`Judging`]); peers' questions are answered from these (`answering.rs`), and orders carried out on
//! them (`commands.rs`). The order of the
//! actions is the order in which they are to be carried out.

use vocabulary::{Component, ComponentKind, ModuleName, ModulePhase, RunId, Step};

use crate::channels::{ChannelLayout, Channels};
use crate::comparing::Comparing;
use crate::correcting::Correcting;
use crate::coverage::Coverage;
use crate::event::{Action, Event, Handling, QuestionToken};
use crate::freeze::Freezing;
use crate::identifying::Identifying;
use crate::intake::{Admission, Intake};
use crate::judging::Judging;
use crate::leaking::Leaking;
use crate::sample::Measurements;
use crate::settings::{ModuleSetup, Sampling, SetupError};
use crate::state::{Condition, Shares, WindowLength, WindowMeans};
use crate::verdict::Transition;
use vocabulary::fault::FaultKind;
use vocabulary::{
    CorrectedReadings, Counters, Evidence, Margins, PastWatch, ReplacedReading, StateAnswer,
    StateQuestion, Verdict,
};

/// The state that survives a restart. The shell stores it and passes it to
/// [`Diagnoser::recall`] before the first event.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Memory {
    /// The sequence number of the latest transition; 0 if there was none.
    pub sequence: u64,
    /// The latest transition of each component that had one.
    pub latest: Vec<Transition>,
    /// The run being diagnosed, and what was watched of it.
    pub watch: Option<PastWatch>,
}

/// The diagnoser of one module.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct Diagnoser {
    pub(crate) module: ModuleName,
    peers: Vec<ModuleName>,
    pub(crate) sampling: Sampling,
    pub(crate) intake: Intake,
    pub(crate) channels: Channels,
    pub(crate) judging: Judging,
    /// Peers' questions that wait for their step.
    pub(crate) held: Vec<(QuestionToken, StateQuestion)>,
    pub(crate) comparing: Comparing,
    identifying: Identifying,
    correcting: Correcting,
    leaking: Leaking,
    freezing: Freezing,
    pub(crate) counters: Counters,
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
            intake: Intake::new(ChannelLayout::of(&setup), setup.sampling()),
            judging: Judging::new(&setup, channels.components()),
            channels,
            held: Vec::new(),
            sampling: setup.sampling(),
            comparing: Comparing::new(&setup),
            identifying: Identifying::new(&setup),
            correcting: Correcting::new(&setup),
            leaking: Leaking::new(&setup),
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
        self.judging.ledger.recall(sequence, latest);
        self.identifying.recall(&self.judging.ledger);
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
            Event::Withdrawn { token } => self.held.retain(|(held, _)| *held != token),
            Event::Answered(answer) => self.take_answer(answer, actions),
            Event::Unanswered { peer, question, .. } => {
                self.take_silence(&peer, question, actions);
            }
            Event::Returned { peer } => self.take_return(&peer, actions),
            Event::Ordered { token, component, order } => {
                let outcome = match self.carry_out(component, order, actions) {
                    Ok(sequence) => Action::Obeyed { token, sequence },
                    Err(refusal) => Action::OrderRefused { token, refusal },
                };
                actions.push(outcome);
            }
        }
        self.freezing.note(&actions[before..]);
    }

    /// No sample follows for now: what was seen of the latest faults is given as far as it goes ([`Action::Freeze`]).
    pub fn end_freeze_frames(&mut self, actions: &mut Vec<Action>) {
        self.freezing.end(&self.channels, actions);
    }

    /// Takes a sample without taking ownership of it; otherwise like [`Event::Sample`].
    pub fn take_sample(&mut self, sample: &Measurements, actions: &mut Vec<Action>) {
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
        self.channels.observe(sample);
        self.counters.samples_non_finite += u64::from(self.channels.is_incomplete());
        let phase = self.channels.update_phase(sample.step);
        let Self { channels, judging, comparing, identifying, correcting, counters, .. } = self;
        let (run, now) = (sample.run, sample.step);
        let mut handling = Handling { run, now, channels, counters, actions };
        for &(channel, occurrence) in channels.occurrences() {
            judging.note(channel, occurrence, &mut handling);
        }
        judging.follow(&mut handling);
        handling.actions.extend(phase);
        judging.judge(&mut handling);
        comparing.compare(judging, &mut handling);
        identifying.follow(&judging.ledger, comparing, &mut handling);
        correcting.follow(&judging.ledger, comparing, &mut handling);
        self.leaking.follow(&self.judging.ledger, sample);
        self.freezing.note(&actions[before..]);
        self.freezing.follow(now, &self.channels, actions);
        self.answer_due(now, actions);
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
            self.correcting.restart();
            self.leaking.restart();
            self.refuse_held(run, actions);
            self.judging.isolator.restart();
            actions.extend(self.judging.ledger.end_run(last).into_iter().map(Action::Publish));
        }
        actions.push(self.channels.begin_run());
    }

    fn take_answer(&mut self, answer: StateAnswer, actions: &mut Vec<Action>) {
        let (peer, question) = (answer.module.clone(), answer.question);
        // The run may have changed since the question was asked; then the answer no longer matters.
        let position = self.intake.position().filter(|(run, _)| *run == question.run);
        let Some((run, now)) = position else { return };
        let Self { channels, judging, comparing, counters, .. } = self;
        let mut handling = Handling { run, now, channels, counters, actions };
        if question.window.is_some() {
            self.correcting.answered(&answer);
            return comparing.answered((&peer, question, Some(answer)), judging, &mut handling);
        }
        judging.answered(answer, &mut handling);
        judging.judge(&mut handling);
    }

    fn take_silence(
        &mut self,
        peer: &ModuleName,
        question: StateQuestion,
        actions: &mut Vec<Action>,
    ) {
        let Some((run, now)) = self.intake.position() else { return };
        let Self { channels, judging, comparing, counters, .. } = self;
        if question.window.is_some() {
            counters.questions_unanswered += 1;
            let mut handling = Handling { run, now, channels, counters, actions };
            comparing.answered((peer, question, None), judging, &mut handling);
        } else if judging.isolator.unanswered(peer, question, now) {
            counters.questions_unanswered += 1;
            judging.judge(&mut Handling { run, now, channels, counters, actions });
        }
    }

    fn take_return(&mut self, peer: &ModuleName, actions: &mut Vec<Action>) {
        let Some((run, now)) = self.intake.position() else { return };
        let Self { channels, judging, counters, .. } = self;
        judging.isolator.returned(peer, now);
        judging.judge(&mut Handling { run, now, channels, counters, actions });
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

    /// Takes a peer's forces at a step of the present run \[N\], with which faulty gages are replaced more precisely. Counts
    /// those that do not fit the reference and returns false.
    pub fn take_forces(&mut self, peer: &ModuleName, step: Step, forces_n: &[f64]) -> bool {
        let fits = self.correcting.hear(peer, step, forces_n);
        self.counters.answers_malformed += u64::from(!fits);
        fits
    }

    /// Is the reading of any gage replaced, or to be?
    #[must_use]
    pub fn replaces_any(&self) -> bool {
        self.correcting.replaces_any()
    }

    /// Writes what each gage reads at the latest step, or should read if it is faulty.
    pub fn write_readings(&self, readings: &mut CorrectedReadings) {
        let now = self.last_step().unwrap_or_default();
        self.correcting.write(&self.channels, now, readings);
    }

    /// The faulty gages, with what they read at the latest step and what they should have read.
    pub fn replaced_readings(&self) -> impl Iterator<Item = (&Component, ReplacedReading)> {
        let now = self.last_step().unwrap_or_default();
        let gages = self.components().iter().filter(|one| one.kind() == ComponentKind::Sensor);
        let gages: Vec<&Component> = gages.collect();
        self.correcting.lost(&self.channels, now).map(move |(gage, reading)| (gages[gage], reading))
    }

    /// When the leak of a cylinder that is declared faulty, of this kind, is as wide as its valve, if it grows \[s\].
    #[must_use]
    pub fn leak_ends_in_s(&self, cylinder: &Component, kind: FaultKind) -> Option<f64> {
        self.leaking.ends_in_s(self.channels.position(cylinder)?, kind)
    }

    /// The observed forces at the latest step \[N\]; NaN without a value.
    #[must_use]
    pub fn forces_n(&self) -> &[f64] {
        self.channels.measured().1
    }

    /// Did a window end at the latest step after which conditions are known anew?
    #[must_use]
    pub fn has_compared(&self) -> bool {
        match self.channels.learned() {
            Some(learned) => learned.has_compared(),
            None => self.window(WindowLength::Long).is_some(),
        }
    }

    /// The condition of each component, in the order of [`Diagnoser::components`].
    pub fn conditions(&self) -> impl Iterator<Item = &Condition> {
        (0..self.channels.components().len()).map(|channel| self.condition(channel))
    }

    /// How near a channel is to being found to depart from its reference; of the change itself, see
    /// [`Diagnoser::excess`].
    #[must_use]
    pub fn margins(&self, channel: usize) -> Margins {
        let unknown = Margins::unknown(self.components()[channel].clone());
        if let Some(learned) = self.channels.learned() {
            return Margins { departure: learned.share(channel), ..unknown };
        }
        let Shares { departure, oil_content, scatter } = self.comparing.shares(channel);
        Margins { departure, oil_content, scatter, ..unknown }
    }

    /// What the latest window said; of a fault whose change is not over, that it is to be compared again: it can
    /// be reset when it agrees.
    pub(crate) fn condition(&self, channel: usize) -> &Condition {
        let compared = self.compared(channel);
        let is_fault = matches!(
            self.judging.ledger.verdict(channel),
            Verdict::Latched | Verdict::Acknowledged
        );
        let agrees = matches!(compared, Condition::Agrees { .. });
        match is_fault && agrees && self.check_change_is_over(channel).is_err() {
            true => &Condition::NotCompared,
            false => compared,
        }
    }

    /// What the latest window said.
    pub(crate) fn compared(&self, channel: usize) -> &Condition {
        match self.channels.learned() {
            Some(learned) => learned.condition(channel),
            None => self.comparing.condition(channel),
        }
    }

    /// The verdict on each component.
    pub fn verdicts(&self) -> impl Iterator<Item = (&Component, &Verdict)> {
        self.judging.ledger.verdicts()
    }

    /// The latest transition of a component, if it ever had one.
    #[must_use]
    pub fn last_transition(&self, component: &Component) -> Option<&Transition> {
        self.judging.ledger.latest(component)
    }

    /// The latest transition of each component that ever had one.
    pub fn last_transitions(&self) -> impl Iterator<Item = &Transition> {
        self.judging.ledger.transitions()
    }

    /// The number that the next transition will have.
    #[must_use]
    pub fn next_sequence(&self) -> u64 {
        self.judging.ledger.next_sequence()
    }

    /// Peers' questions that wait for their step.
    #[must_use]
    pub fn waiting_questions(&self) -> usize {
        self.held.len()
    }
}
