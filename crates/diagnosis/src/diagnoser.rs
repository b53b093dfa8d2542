//! One module's diagnoser: samples, questions and answers in, actions out.
//!
//! Data flows one way: sample → residuals → divergences → changes → judgements → transitions. The
//! order of the actions is the order in which they are to be carried out.

use truss::Structure;
use truss::ids::{Component, ModuleName, RunId, Step};

use crate::change::Change;
use crate::counters::Counters;
use crate::divergence::{DivergenceBank, Outcome};
use crate::event::{Action, Event, QuestionToken};
use crate::evidence::Evidence;
use crate::held_questions::HeldQuestions;
use crate::isolation::{Case, Finding, Isolator, Judgement};
use crate::ledger::Ledger;
use crate::monitor::{Monitor, Observation};
use crate::phase::Phase;
use crate::question::{ActuatorFault, Answer, PeerFailure, Question, Refusal};
use crate::residual::ResidualGenerator;
use crate::sample::{Sample, SampleRejection};
use crate::settings::{ModuleSetup, SetupError};
use crate::verdict::{Transition, Verdict};

/// Most steps that a single sample may lie ahead of the one before it: ten seconds at 1 kHz.
const LONGEST_LEAP: u64 = 10_000;

/// The diagnoser of one module.
#[derive(Debug, Clone)]
pub struct Diagnoser {
    module: ModuleName,
    peers: Vec<ModuleName>,
    components: Vec<Component>,
    actuators: usize,
    generator: ResidualGenerator,
    bank: DivergenceBank,
    monitors: Vec<Monitor>,
    evidence: Vec<Evidence>,
    isolator: Isolator,
    ledger: Ledger,
    held: HeldQuestions,
    phase: Phase,
    run: Option<RunId>,
    last_step: Option<Step>,
    /// Where a sample landed that leapt too far to be believed alone.
    leap: Option<Step>,
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
        let components = components(&setup.structure, &setup.module);
        let model_error = |error: truss::ModelError| {
            vec![SetupError::Model { module: setup.module.clone(), error: error.to_string() }]
        };
        let detection = &setup.detection;
        let generator = ResidualGenerator::new(
            &setup.structure,
            setup.hydraulics,
            detection.actuator_residual,
            setup.step_s,
        )
        .map_err(model_error)?;
        let bank = DivergenceBank::new(detection.divergence, &setup.prior_scatters())
            .map_err(|error| vec![error.into()])?;
        let quiet = setup.isolation.quiet_steps;
        let monitor = |&threshold: &f64| Monitor::new(threshold, detection.warm_up_vectors, quiet);
        let monitors: Vec<_> = setup.thresholds.iter().map(monitor).collect();
        Ok(Self {
            actuators: components.iter().filter(|c| matches!(c, Component::Actuator(_))).count(),
            isolator: Isolator::new(
                setup.module.clone(),
                components.clone(),
                &setup.peers,
                setup.isolation,
            ),
            ledger: Ledger::new(&components),
            evidence: monitors.iter().map(|monitor| *monitor.evidence()).collect(),
            module: setup.module,
            peers: setup.peers,
            components,
            generator,
            bank,
            monitors,
            held: HeldQuestions::default(),
            phase: Phase::Waiting,
            run: None,
            last_step: None,
            leap: None,
            counters: Counters::default(),
        })
    }

    /// Takes an event; appends what is to be done.
    pub fn handle(&mut self, event: Event, actions: &mut Vec<Action>) {
        match event {
            Event::Sample(sample) => self.take_sample(&sample, actions),
            Event::Asked { token, question } => self.take_question(token, question, actions),
            Event::Withdrawn { token } => self.held.withdraw(token),
            Event::Answered { peer, answer } => self.take_answer(&peer, answer, actions),
            Event::Unanswered { peer, question, .. } => {
                self.take_silence(&peer, question, actions);
            }
        }
    }

    /// Takes a sample without taking ownership of it; otherwise like [`Event::Sample`].
    pub fn take_sample(&mut self, sample: &Sample, actions: &mut Vec<Action>) {
        if let Err(rejection) = self.admit(sample, actions) {
            self.count_rejection(rejection);
            actions.push(Action::Rejected { step: sample.step, rejection });
            return;
        }
        self.counters.samples += 1;
        self.last_step = Some(sample.step);
        self.watch(sample, actions);
        self.update_phase(sample.step, actions);
        self.judge(sample.run, sample.step, actions);
        self.answer_due(sample.step, actions);
    }

    /// Checks a sample and bridges a gap before it; begins a new run if it belongs to one.
    fn admit(&mut self, sample: &Sample, actions: &mut Vec<Action>) -> Result<(), SampleRejection> {
        sample.check(self.actuators, self.components.len() - self.actuators)?;
        if self.run != Some(sample.run) {
            self.begin_run(sample.run, actions);
        }
        let Some(last) = self.last_step else { return Ok(()) };
        if sample.step <= last {
            return Err(SampleRejection::Repeated);
        }
        self.check_leap(last, sample.step)?;
        let missing = sample.step.since(last) - 1;
        if missing > 0 {
            self.counters.samples_missing += missing;
            self.generator.bridge(missing);
            self.bank.gap();
            actions.push(Action::Gap { from: last.plus(1), missing });
        }
        Ok(())
    }

    /// A leap is believed once a second sample follows where the first one landed.
    fn check_leap(&mut self, last: Step, step: Step) -> Result<(), SampleRejection> {
        let landed = self.leap.replace(step);
        if step.since(last) > LONGEST_LEAP && landed.map(|landed| landed.plus(1)) != Some(step) {
            return Err(SampleRejection::FarAhead);
        }
        self.leap = None;
        Ok(())
    }

    fn count_rejection(&mut self, rejection: SampleRejection) {
        let counter = match rejection {
            SampleRejection::WrongLength => &mut self.counters.samples_wrong_length,
            SampleRejection::NonFinite => &mut self.counters.samples_non_finite,
            SampleRejection::Repeated => &mut self.counters.samples_repeated,
            SampleRejection::FarAhead => &mut self.counters.samples_far_ahead,
        };
        *counter += 1;
    }

    /// Forgets everything but latched faults.
    fn begin_run(&mut self, run: RunId, actions: &mut Vec<Action>) {
        let previous = self.run.replace(run);
        self.counters.runs += 1;
        self.generator.restart();
        self.bank.restart();
        self.monitors.iter_mut().for_each(Monitor::restart);
        self.isolator.restart();
        self.last_step = None;
        self.leap = None;
        self.phase = Phase::Initialising;
        actions.push(Action::RunStarted(run));
        actions.push(Action::Phase(self.phase));
        while let Some((token, question)) = self.held.take_any() {
            let refusal = Refusal::OtherRun { asked: question.run, present: run };
            self.refuse(token, refusal, actions);
        }
        if previous.is_some() {
            for channel in 0..self.components.len() {
                actions.extend(self.ledger.clear(run, channel, Step(0)).map(Action::Publish));
            }
        }
    }

    /// Sample → residuals → divergences → changes.
    fn watch(&mut self, sample: &Sample, actions: &mut Vec<Action>) {
        let residuals = self.generator.push(sample);
        let outcomes = self.bank.push(residuals);
        for (channel, monitor) in self.monitors.iter_mut().enumerate() {
            let outcome = outcomes[channel];
            let component = &self.components[channel];
            if let Outcome::Restarted(violation) = outcome {
                self.counters.restarts += 1;
                actions.push(Action::Restarted { component: component.clone(), violation });
            }
            let observation = monitor.observe(sample.step, residuals[channel], outcome);
            let evidence = *monitor.evidence();
            self.evidence[channel] = evidence;
            match observation {
                Observation::Nothing => {}
                Observation::Changed { onset } => {
                    self.counters.changes += 1;
                    // Whatever the verdict on an earlier change will be, this one is judged too: the
                    // outcome must not depend on when a peer's answer comes.
                    let judge = !self.ledger.verdict(channel).is_latched();
                    self.isolator.change(channel, onset, evidence, judge);
                    let step = sample.step;
                    let change =
                        Change { component: component.clone(), step, ratio: evidence.ratio() };
                    actions.push(Action::Report { run: sample.run, change, evidence });
                }
                Observation::Quiet => {
                    if matches!(self.ledger.verdict(channel), Verdict::Explained { .. }) {
                        let cleared = self.ledger.clear(sample.run, channel, sample.step);
                        actions.extend(cleared.map(Action::Publish));
                    }
                }
            }
        }
        let evidence = &self.evidence;
        self.isolator.follow(sample.step, |channel| evidence[channel].ratio());
    }

    fn update_phase(&mut self, step: Step, actions: &mut Vec<Action>) {
        let all_watched = self.monitors.iter().all(Monitor::is_watched);
        let phase = match (all_watched, self.phase) {
            (true, Phase::InService { since }) => Phase::InService { since },
            (true, _) => Phase::InService { since: step },
            (false, _) => Phase::Initialising,
        };
        if phase != self.phase {
            self.phase = phase;
            actions.push(Action::Phase(phase));
        }
    }

    /// Changes → judgements → transitions, and questions where something is not known.
    fn judge(&mut self, run: RunId, now: Step, actions: &mut Vec<Action>) {
        if self.isolator.is_idle() {
            return;
        }
        let latched: Vec<_> = (self.ledger.latched_actuators(&self.module))
            .map(|(path, transition)| (path, transition.detection))
            .collect();
        for (case, finding) in self.isolator.findings(now, &latched) {
            self.enter(run, &case, finding, now, actions);
        }
        for case in self.isolator.new_cases() {
            let tentative = self.ledger.enter(run, &case, Verdict::Tentative, now);
            actions.extend(tentative.map(Action::Publish));
        }
        for (peer, question) in self.isolator.questions(run, now) {
            self.counters.questions_asked += 1;
            actions.push(Action::Ask { peer, question });
        }
    }

    fn enter(
        &mut self,
        run: RunId,
        case: &Case,
        finding: Finding,
        now: Step,
        actions: &mut Vec<Action>,
    ) {
        let (verdict, decided) = match finding {
            Finding::Judged(Judgement::Root) => (Verdict::Latched, case.decide_at),
            Finding::Judged(Judgement::Explained { by, since }) => {
                (Verdict::Explained { by, since }, case.decide_at)
            }
            Finding::Silent(silent) => (Verdict::Unconfirmed { silent }, now),
        };
        let explained = matches!(verdict, Verdict::Explained { .. });
        actions.extend(self.ledger.enter(run, case, verdict, decided).map(Action::Publish));
        if explained && !self.monitors[case.channel].is_active() {
            actions.extend(self.ledger.clear(run, case.channel, now).map(Action::Publish));
        }
    }

    fn take_answer(&mut self, peer: &ModuleName, answer: Answer, actions: &mut Vec<Action>) {
        let (Some(run), Some(now)) = (self.run, self.last_step) else { return };
        match self.isolator.answered(peer, answer, now) {
            Ok(()) => {}
            Err(PeerFailure::Malformed(_)) => self.counters.answers_malformed += 1,
            Err(_) => self.counters.questions_unanswered += 1,
        }
        self.judge(run, now, actions);
    }

    fn take_silence(&mut self, peer: &ModuleName, question: Question, actions: &mut Vec<Action>) {
        let (Some(run), Some(now)) = (self.run, self.last_step) else { return };
        if self.isolator.unanswered(peer, question, now) {
            self.counters.questions_unanswered += 1;
            self.judge(run, now, actions);
        }
    }

    fn take_question(
        &mut self,
        token: QuestionToken,
        question: Question,
        actions: &mut Vec<Action>,
    ) {
        let held = match (self.run, self.last_step) {
            (Some(run), _) if run != question.run => {
                Err(Refusal::OtherRun { asked: question.run, present: run })
            }
            (Some(_), Some(now)) => self.held.hold(token, question, now),
            _ => Err(Refusal::NoSample),
        };
        match (held, self.last_step) {
            (Err(refusal), _) => self.refuse(token, refusal, actions),
            (Ok(()), Some(now)) => self.answer_due(now, actions),
            (Ok(()), None) => {}
        }
    }

    fn refuse(&mut self, token: QuestionToken, refusal: Refusal, actions: &mut Vec<Action>) {
        self.counters.questions_refused += 1;
        actions.push(Action::Refuse { token, refusal });
    }

    fn answer_due(&mut self, now: Step, actions: &mut Vec<Action>) {
        while let Some((token, question)) = self.held.take_due(now) {
            self.counters.answers_given += 1;
            actions.push(Action::Answer { token, answer: self.answer(question) });
        }
    }

    /// What this module has to say as of a step that it has processed.
    fn answer(&self, question: Question) -> Answer {
        let Question { from, as_of, .. } = question;
        let changes = self.isolator.log().between(from, as_of).map(|change| Change {
            component: self.components[change.channel].clone(),
            step: change.step,
            ratio: change.ratio_as_of(as_of),
        });
        let faults = self.ledger.latched_actuators(&self.module);
        let in_time = faults.filter(|(_, transition)| transition.decided <= as_of);
        let actuator_faults = in_time.filter_map(|(path, transition)| match path.component {
            Component::Actuator(actuator) => {
                Some(ActuatorFault { actuator, step: transition.detection })
            }
            Component::Sensor(_) => None,
        });
        Answer {
            question,
            watching_since: self.watching_since(),
            changes: changes.collect(),
            actuator_faults: actuator_faults.collect(),
        }
    }

    fn watching_since(&self) -> Option<Step> {
        match self.phase {
            Phase::InService { since } => Some(since.max(self.isolator.log().known_from())),
            Phase::Waiting | Phase::Initialising => None,
        }
    }

    /// The phase.
    #[must_use]
    pub fn phase(&self) -> Phase {
        self.phase
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
        self.run
    }

    /// The latest step processed.
    #[must_use]
    pub fn last_step(&self) -> Option<Step> {
        self.last_step
    }

    /// The channels: actuators, then gages, in the order of the description.
    #[must_use]
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// Each channel at the latest step.
    #[must_use]
    pub fn evidence(&self) -> &[Evidence] {
        &self.evidence
    }

    /// The verdict on each component.
    pub fn verdicts(&self) -> impl Iterator<Item = (&Component, &Verdict)> {
        self.ledger.verdicts()
    }

    /// The latest transition of a component, if it ever had one.
    #[must_use]
    pub fn last_transition(&self, component: &Component) -> Option<&Transition> {
        self.ledger.latest(component)
    }

    /// The number that the next transition will have.
    #[must_use]
    pub fn next_sequence(&self) -> u64 {
        self.ledger.next_sequence()
    }

    /// Peers' questions that wait for their step.
    #[must_use]
    pub fn waiting_questions(&self) -> usize {
        self.held.len()
    }
}

/// The channels of a module, in order.
fn components(structure: &Structure, name: &ModuleName) -> Vec<Component> {
    structure.module(name).map_or_else(Vec::new, |module| module.components().collect())
}
