//! One module's diagnoser: samples, questions and answers in, actions out.
//!
//! Data flows one way: sample → residuals → divergences → changes → judgements → transitions. The
//! order of the actions is the order in which they are to be carried out.

use std::cmp::Ordering;

use truss::Structure;
use truss::ids::{Component, ModuleName, RunId, Step};

use crate::change::{Change, LoggedChange};
use crate::counters::Counters;
use crate::coverage::Coverage;
use crate::divergence::{DivergenceBank, DivergenceSettings, Outcome};
use crate::event::{Action, Event, QuestionToken};
use crate::evidence::Evidence;
use crate::held_questions::HeldQuestions;
use crate::isolation::{Case, Finding, Isolator, Judgement};
use crate::ledger::Ledger;
use crate::memory::{Memory, PastWatch};
use crate::monitor::{Monitor, Observation};
use crate::phase::Phase;
use crate::question::{ActuatorFault, Answer, PeerFailure, Question, Refusal};
use crate::residual::ResidualGenerator;
use crate::sample::{Sample, SampleRejection};
use crate::settings::{ModuleSetup, SetupError};
use crate::verdict::{Doubt, Transition, Verdict};

/// Most steps that a single sample may lie ahead of the one before it: ten seconds at 1 kHz.
const LONGEST_LEAP: u64 = 10_000;

/// The diagnoser of one module.
#[derive(Debug, Clone)]
pub struct Diagnoser {
    module: ModuleName,
    peers: Vec<ModuleName>,
    pub(crate) components: Vec<Component>,
    actuators: usize,
    pub(crate) detection: DivergenceSettings,
    generator: ResidualGenerator,
    pub(crate) bank: DivergenceBank,
    pub(crate) monitors: Vec<Monitor>,
    evidence: Vec<Evidence>,
    pub(crate) isolator: Isolator,
    pub(crate) ledger: Ledger,
    held: HeldQuestions,
    coverage: Coverage,
    /// The run that was being diagnosed before a restart, until the first sample comes.
    recalled_run: Option<RunId>,
    phase: Phase,
    run: Option<RunId>,
    pub(crate) last_step: Option<Step>,
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
            detection: detection.divergence,
            evidence: monitors.iter().map(|monitor| *monitor.evidence()).collect(),
            module: setup.module,
            peers: setup.peers,
            components,
            generator,
            bank,
            monitors,
            held: HeldQuestions::default(),
            coverage: Coverage::default(),
            recalled_run: None,
            phase: Phase::Waiting,
            run: None,
            last_step: None,
            leap: None,
            counters: Counters::default(),
        })
    }

    /// Takes up what was known before a restart; to be called before the first event.
    pub fn recall(&mut self, memory: Memory) {
        let Memory { sequence, latest, watch } = memory;
        self.ledger.recall(sequence, latest);
        let Some(PastWatch { run, watched, changes }) = watch else { return };
        self.recalled_run = Some(run);
        if let Some((since, until)) = watched {
            self.coverage = Coverage::recalled(since, until);
        }
        let channel = |component| self.components.iter().position(|own| own == component);
        let known = changes.iter().filter_map(|change| {
            let channel = channel(&change.component)?;
            Some(LoggedChange::new(channel, change.step, change.ratio))
        });
        self.isolator.recall_changes(known.collect::<Vec<_>>());
        self.recall_open_cases(run);
    }

    /// Changes that were not judged before the restart are judged after it.
    fn recall_open_cases(&mut self, run: RunId) {
        for channel in 0..self.components.len() {
            let Some(latest) = self.ledger.latest(&self.components[channel]) else { continue };
            let open = matches!(
                latest.verdict,
                Verdict::Tentative | Verdict::Unconfirmed { doubt: Doubt::Silent(_) }
            );
            if !open || latest.run != run {
                continue;
            }
            self.isolator.recall_case(channel, latest);
            let (step, ratio) = (latest.detection, latest.evidence.ratio());
            if !self.isolator.sees_again(channel, step, ratio) {
                self.isolator.recall_changes([LoggedChange::new(channel, step, ratio)]);
            }
        }
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
            Event::Returned { peer } => self.take_return(&peer, actions),
            Event::Ordered { token, order } => self.take_order(token, order, actions),
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
        match sample.step.cmp(&last) {
            Ordering::Less => return Err(SampleRejection::Late),
            Ordering::Equal => return Err(SampleRejection::Repeated),
            Ordering::Greater => {}
        }
        self.check_leap(last, sample.step)?;
        let missing = sample.step.since(last) - 1;
        if missing > 0 {
            self.counters.samples_missing += missing;
            self.coverage.lose(last);
            self.bridge(missing);
            actions.push(Action::Gap { from: last.plus(1), missing });
        }
        Ok(())
    }

    /// After a long gap the channels are learnt anew: the structure's oscillation is not known, and what
    /// the models do while they settle would look like a fault.
    fn bridge(&mut self, missing: u64) {
        if self.generator.bridge(missing) {
            self.bank.gap();
        } else {
            self.bank.restart();
            self.monitors.iter_mut().for_each(Monitor::relearn);
        }
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
            SampleRejection::Late => &mut self.counters.samples_late,
            SampleRejection::FarAhead => &mut self.counters.samples_far_ahead,
        };
        *counter += 1;
    }

    /// Forgets everything but what is latched or can never be judged. A run that goes on after a restart
    /// forgets nothing.
    fn begin_run(&mut self, run: RunId, actions: &mut Vec<Action>) {
        let previous = self.run.replace(run).or(self.recalled_run.take());
        self.counters.runs += 1;
        self.phase = Phase::Initialising;
        actions.push(Action::RunStarted(run));
        if previous.is_some_and(|previous| previous != run) {
            self.end_run(run, actions);
        }
        actions.push(Action::Phase(self.phase));
    }

    fn end_run(&mut self, present: RunId, actions: &mut Vec<Action>) {
        let last = self.last_step.take().unwrap_or_default();
        self.generator.restart();
        self.bank.restart();
        self.monitors.iter_mut().for_each(Monitor::restart);
        self.isolator.restart();
        self.coverage = Coverage::default();
        self.leap = None;
        while let Some((token, question)) = self.held.take_any() {
            let refusal = Refusal::OtherRun { asked: question.run, present };
            self.refuse(token, refusal, actions);
        }
        for channel in 0..self.components.len() {
            actions.extend(self.ledger.end_run(channel, last).map(Action::Publish));
        }
    }

    /// Sample → residuals → divergences → changes.
    fn watch(&mut self, sample: &Sample, actions: &mut Vec<Action>) {
        let settled = self.generator.is_settled();
        let residuals = self.generator.push(sample);
        let outcomes = if settled { self.bank.push(residuals) } else { self.bank.skip() };
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
                Observation::Changed { .. }
                    if self.isolator.sees_again(channel, sample.step, evidence.ratio()) => {}
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
                        let cleared = self.ledger.clear(channel, sample.step);
                        actions.extend(cleared.map(Action::Publish));
                    }
                }
            }
        }
        let evidence = &self.evidence;
        self.isolator.follow(sample.step, |channel| evidence[channel].ratio());
        while let Some(settled) = self.isolator.settle(sample.step) {
            let component = self.components[settled.channel].clone();
            let ratio = settled.ratio_as_of(sample.step);
            let change = Change { component, step: settled.step, ratio };
            actions.push(Action::Settled { run: sample.run, change });
        }
    }

    fn update_phase(&mut self, step: Step, actions: &mut Vec<Action>) {
        // After a gap there is no divergence for a while, and nothing is seen.
        let sees =
            |monitor: &Monitor| monitor.is_watched() && monitor.evidence().divergence.is_some();
        if self.monitors.iter().all(sees) {
            self.coverage.watch(step);
        } else {
            self.coverage.lose(step.minus(1));
        }
        let phase = match self.coverage.watched_since() {
            Some(since) => Phase::InService { since },
            None => Phase::Initialising,
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
        let latched: Vec<_> = (self.ledger.latched_actuators(&self.module, run))
            .map(|(path, since)| (path, since.change))
            .collect();
        for (case, finding) in self.isolator.findings(now, &latched, &self.coverage) {
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
            Finding::Silent(silent) => (Verdict::Unconfirmed { doubt: Doubt::Silent(silent) }, now),
            Finding::Unknowing(modules) => {
                (Verdict::Unconfirmed { doubt: Doubt::Unknowing(modules) }, now)
            }
        };
        let explained = matches!(verdict, Verdict::Explained { .. });
        actions.extend(self.ledger.enter(run, case, verdict, decided).map(Action::Publish));
        if explained && !self.monitors[case.channel].is_active() {
            actions.extend(self.ledger.clear(case.channel, now).map(Action::Publish));
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

    fn take_return(&mut self, peer: &ModuleName, actions: &mut Vec<Action>) {
        let (Some(run), Some(now)) = (self.run, self.last_step) else { return };
        self.isolator.returned(peer, now);
        self.judge(run, now, actions);
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
            _ if self.remembers(&question) => {
                self.counters.answers_given += 1;
                actions.push(Action::Answer { token, answer: self.answer(question) });
                return;
            }
            _ => Err(Refusal::NoSample),
        };
        match (held, self.last_step) {
            (Err(refusal), _) => self.refuse(token, refusal, actions),
            (Ok(()), Some(now)) => self.answer_due(now, actions),
            (Ok(()), None) => {}
        }
    }

    /// Can the question be answered from before the restart?
    fn remembers(&self, question: &Question) -> bool {
        self.recalled_run == Some(question.run) && self.coverage.since(question.as_of).is_some()
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
        let Question { run, from, as_of } = question;
        let changes = self.isolator.log().between(from, as_of).map(|change| Change {
            component: self.components[change.channel].clone(),
            step: change.step,
            ratio: change.ratio_as_of(as_of),
        });
        let faults = self.ledger.latched_actuators(&self.module, run);
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
        }
    }

    fn watching_since(&self, as_of: Step) -> Option<Step> {
        let since = self.coverage.since(as_of)?;
        Some(since.max(self.isolator.log().known_from()))
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
