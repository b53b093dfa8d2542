//! Between what a diagnoser takes and gives, and messages. Both ways lose nothing that a verdict depends on: finite
//! numbers come back as the very same bits.

mod configuration;
mod freeze_frame;
mod identification;
mod input;
mod order;
mod shelving;

pub use configuration::{setup_fingerprint, to_setup};
pub use input::{from_taken, to_memory, to_taken};
pub use order::from_wire_order;
pub use shelving::to_wire_shelving;

use diagnosis::state::{self, CylinderMeans, GageMeans, WindowLength, WindowMeans};
use diagnosis::{Answer, Counters, Doubt, Phase, Question, Symptom, Transition, Verdict};
use names::{Component, ComponentPath, ModuleName, RunId, Step, StructureName};
use wire::{Agreement, FaultState, FaultTransition, ModulePhase};

use order::{from_given_order, to_wire_order};
use shelving::from_wire_shelving;

/// The publishing module.
#[derive(Debug, Clone)]
pub struct Speaker {
    /// Its structure.
    pub structure: StructureName,
    /// Its name.
    pub module: ModuleName,
    /// What its sequence numbers count in, as it stands in [`FaultTransition::incarnation`].
    pub incarnation: u64,
}

impl Speaker {
    /// One without a journal.
    #[must_use]
    pub fn of(structure: StructureName, module: ModuleName) -> Self {
        Self { structure, module, incarnation: 0 }
    }

    /// The key of one of its topics.
    #[must_use]
    pub fn key(&self, topic: wire::Topic) -> String {
        wire::Key::of_module(&self.structure, &self.module, topic).to_string()
    }

    /// One of its components, with its name before.
    #[must_use]
    pub fn path(&self, component: &Component) -> ComponentPath {
        ComponentPath { module: self.module.clone(), component: component.clone() }
    }

    /// The message on a component that never had a transition.
    #[must_use]
    pub fn untouched(&self, component: &Component, time_unix_ns: u64) -> FaultTransition {
        let (structure, component) = (self.structure.clone(), self.path(component));
        let incarnation = self.incarnation;
        FaultTransition {
            incarnation,
            ..FaultTransition::untouched(structure, component, time_unix_ns)
        }
    }

    /// The message on a transition.
    #[must_use]
    pub fn transition(&self, transition: Transition, time_unix_ns: u64) -> FaultTransition {
        let Transition {
            sequence,
            run,
            component,
            verdict,
            symptom,
            onset,
            detection,
            decided,
            evidence,
            before_service,
            disputed,
            tare,
            order,
            verdict_order,
            shelved,
            suppressed,
        } = transition;
        let mut message = self.untouched(&component, time_unix_ns);
        message.sequence = sequence;
        message.run = Some(run);
        message.onset_step = Some(onset);
        message.detection_step = Some(detection);
        message.decided_step = Some(decided);
        message.evidence = Some(to_wire_evidence(&evidence));
        message.order = order.map(to_wire_order);
        message.state_order = verdict_order.map(|order| Box::new(to_wire_order(*order)));
        message.shelved = shelved.map(|shelving| to_wire_shelving(*shelving));
        message.suppressed = suppressed.map(|shelving| to_wire_shelving(*shelving));
        message.state = to_state(&verdict);
        message.disputed = disputed;
        message.before_service = before_service;
        message.tare = tare;
        message.symptom = to_symptom(symptom);
        match verdict {
            Verdict::Unconfirmed { doubt } => enter_doubt(&mut message, doubt),
            Verdict::Explained { by, since } => {
                message.explained_by = Some(by);
                message.explained_since_step = Some(since);
            }
            Verdict::Normal | Verdict::Tentative | Verdict::Latched | Verdict::Acknowledged => {}
        }
        message
    }

    /// The message on a change.
    #[must_use]
    pub fn change(
        &self,
        run: RunId,
        change: &diagnosis::Change,
        evidence: &diagnosis::Evidence,
        time_unix_ns: u64,
    ) -> wire::Change {
        wire::Change {
            structure: self.structure.clone(),
            component: self.path(&change.component),
            run,
            step: change.step,
            evidence: to_wire_evidence(evidence),
            time_unix_ns,
        }
    }

    /// The message on its channels, each with what is known of it at this step.
    #[must_use]
    pub fn divergences(
        &self,
        run: RunId,
        step: Step,
        channels: (&[Component], &[diagnosis::Evidence]),
        time_unix_ns: u64,
    ) -> wire::Divergences {
        let (components, evidence) = channels;
        let channel = |(component, evidence): (&Component, &diagnosis::Evidence)| wire::Channel {
            component: component.clone(),
            residual: evidence.residual,
            divergence: evidence.divergence,
            threshold: evidence.threshold,
        };
        wire::Divergences {
            structure: self.structure.clone(),
            module: self.module.clone(),
            run,
            step,
            time_unix_ns,
            channels: components.iter().zip(evidence).map(channel).collect(),
        }
    }

    /// The message with its answer to a peer.
    #[must_use]
    pub fn answer(&self, answer: Answer) -> wire::StateAnswer {
        let Answer { question, watching_since, changes, actuator_faults, alarms, window } = answer;
        let changes = changes.into_iter().map(to_change);
        let faults = actuator_faults
            .into_iter()
            .map(|fault| wire::ActuatorFault { actuator: fault.actuator, step: fault.step });
        wire::StateAnswer {
            structure: self.structure.clone(),
            module: self.module.clone(),
            run: question.run,
            from_step: question.from,
            as_of_step: question.as_of,
            watching_since_step: watching_since,
            changes: changes.collect(),
            actuator_faults: faults.collect(),
            alarms: alarms.into_iter().map(to_alarm).collect(),
            window: window.map(to_window),
        }
    }
}

fn enter_doubt(message: &mut FaultTransition, doubt: Doubt) {
    message.doubt = Some(match doubt {
        Doubt::Silent(modules) => {
            message.silent = modules;
            wire::Doubt::Silent
        }
        Doubt::Unknowing(modules) => {
            message.unknowing = modules;
            wire::Doubt::Unknowing
        }
        Doubt::Assumed(actuator) => {
            message.assumed = Some(actuator);
            wire::Doubt::Assumed
        }
        Doubt::OneOf(components) => {
            message.one_of = components;
            wire::Doubt::OneOf
        }
        Doubt::RunEnded => wire::Doubt::RunEnded,
    });
}

/// A transition as it was before it was sent; `None` for a component that never had one.
#[must_use]
pub fn from_transition(message: FaultTransition) -> Option<Transition> {
    let verdict = match message.state {
        FaultState::Unknown => return None,
        FaultState::Normal => Verdict::Normal,
        FaultState::Tentative => Verdict::Tentative,
        FaultState::Unconfirmed => Verdict::Unconfirmed {
            doubt: match message.doubt? {
                wire::Doubt::Silent => Doubt::Silent(message.silent),
                wire::Doubt::Unknowing => Doubt::Unknowing(message.unknowing),
                wire::Doubt::Assumed => Doubt::Assumed(message.assumed?),
                wire::Doubt::OneOf => Doubt::OneOf(message.one_of),
                wire::Doubt::RunEnded => Doubt::RunEnded,
            },
        },
        FaultState::Explained => {
            Verdict::Explained { by: message.explained_by?, since: message.explained_since_step? }
        }
        FaultState::Latched => Verdict::Latched,
        FaultState::Acknowledged => Verdict::Acknowledged,
    };
    Some(Transition {
        sequence: message.sequence,
        run: message.run?,
        component: message.component.component,
        verdict,
        symptom: from_symptom(message.symptom),
        onset: message.onset_step?,
        detection: message.detection_step?,
        decided: message.decided_step?,
        evidence: from_wire_evidence(&message.evidence?),
        before_service: message.before_service,
        disputed: message.disputed,
        tare: message.tare,
        verdict_order: message.state_order.map(|order| Box::new(from_given_order(*order))),
        order: message.order.map(from_given_order),
        shelved: message.shelved.map(from_wire_shelving).map(Box::new),
        suppressed: message.suppressed.map(from_wire_shelving).map(Box::new),
    })
}

fn from_wire_evidence(evidence: &wire::Evidence) -> diagnosis::Evidence {
    let wire::Evidence { step, residual, level, divergence, threshold, ratio: _ } = *evidence;
    diagnosis::Evidence { step, residual, level, divergence, threshold }
}

fn to_wire_evidence(evidence: &diagnosis::Evidence) -> wire::Evidence {
    wire::Evidence {
        step: evidence.step,
        residual: evidence.residual,
        level: evidence.level,
        divergence: evidence.divergence,
        threshold: evidence.threshold,
        ratio: evidence.ratio(),
    }
}

/// A question to a peer.
#[must_use]
pub fn to_question(question: Question) -> wire::StateQuestion {
    let Question { run, from, as_of, window } = question;
    let window = window.map(to_window_length);
    wire::StateQuestion { run: Some(run), from, step: as_of, window }
}

fn to_window_length(length: WindowLength) -> wire::WindowLength {
    match length {
        WindowLength::Short => wire::WindowLength::Short,
        WindowLength::Long => wire::WindowLength::Long,
    }
}

/// How long a window is.
#[must_use]
pub fn from_window_length(length: wire::WindowLength) -> WindowLength {
    match length {
        wire::WindowLength::Short => WindowLength::Short,
        wire::WindowLength::Long => WindowLength::Long,
    }
}

/// A change as it stands in answers and journals.
#[must_use]
pub fn to_change(change: diagnosis::Change) -> wire::StateChange {
    let diagnosis::Change { component, onset, step, ratio, until } = change;
    let onset_step = (onset < step).then_some(onset);
    let going_on = until.is_none();
    wire::StateChange { component, step, onset_step, ratio, until_step: until, going_on }
}

/// The same back.
#[must_use]
pub fn from_change(change: wire::StateChange) -> diagnosis::Change {
    let wire::StateChange { component, step, onset_step, ratio, until_step, going_on } = change;
    let until = (!going_on).then_some(until_step.unwrap_or(step));
    diagnosis::Change { component, onset: onset_step.unwrap_or(step), step, ratio, until }
}

/// `window`: the means of a window of which length were asked for, if any?
#[must_use]
pub fn from_answer(answer: wire::StateAnswer, window: Option<WindowLength>) -> Answer {
    let until = answer.as_of_step;
    // What was not asked for is not looked at.
    let means = window.zip(answer.window).map(|(length, means)| from_window(means, length, until));
    let changes = answer.changes.into_iter().map(from_change);
    let faults = answer
        .actuator_faults
        .into_iter()
        .map(|fault| diagnosis::ActuatorFault { actuator: fault.actuator, step: fault.step });
    Answer {
        question: Question {
            run: answer.run,
            from: answer.from_step,
            as_of: answer.as_of_step,
            window,
        },
        watching_since: answer.watching_since_step,
        changes: changes.collect(),
        actuator_faults: faults.collect(),
        alarms: answer.alarms.into_iter().map(from_alarm).collect(),
        window: means,
    }
}

/// In words what keeps a component from being normal.
#[must_use]
pub fn to_condition(condition: &state::Condition) -> wire::Condition {
    use state::Condition as Known;
    let (agreement, as_of_step, reason) = match condition {
        Known::NotVerified => (Agreement::NotVerified, None, None),
        Known::NotCompared => {
            (Agreement::NotCompared, None, Some("not compared with its reference yet".to_owned()))
        }
        Known::Agrees { as_of } => (Agreement::Agrees, Some(*as_of), None),
        Known::Doubtful { as_of } => {
            let reason = "it departed from its reference in the latest window";
            (Agreement::Doubtful, Some(*as_of), Some(reason.to_owned()))
        }
        Known::Departed { as_of } => {
            (Agreement::Departed, Some(*as_of), Some("it departs from its reference".to_owned()))
        }
        Known::OneOf { as_of, components } => {
            let names: Vec<String> = components.iter().map(ToString::to_string).collect();
            let reason = format!("one of these departs from its reference: {}", names.join(", "));
            (Agreement::OneOf, Some(*as_of), Some(reason))
        }
        Known::CannotTell { obstacle } => {
            (Agreement::CannotTell, None, Some(format!("it cannot be compared: {obstacle}")))
        }
    };
    wire::Condition { agreement, as_of_step, reason }
}

fn to_symptom(symptom: Symptom) -> wire::Symptom {
    match symptom {
        Symptom::Change => wire::Symptom::Change,
        Symptom::NoSignal => wire::Symptom::NoSignal,
        Symptom::Departure => wire::Symptom::Departure,
        Symptom::OilContent => wire::Symptom::OilContent,
        Symptom::Scatter => wire::Symptom::Scatter,
    }
}

fn from_symptom(symptom: wire::Symptom) -> Symptom {
    match symptom {
        wire::Symptom::Change => Symptom::Change,
        wire::Symptom::NoSignal => Symptom::NoSignal,
        wire::Symptom::Departure => Symptom::Departure,
        wire::Symptom::OilContent => Symptom::OilContent,
        wire::Symptom::Scatter => Symptom::Scatter,
    }
}

fn to_window(means: WindowMeans) -> wire::Window {
    let gage = |GageMeans { residual_m, scatter_m2, swing_m2 }| wire::GageWindow {
        residual_m,
        scatter_m2,
        swing_m2,
    };
    let cylinder = |CylinderMeans { force_n, rate_n_per_s, tracking_n, content_pa }| {
        wire::CylinderWindow { force_n, rate_n_per_s, tracking_n, content_pa }
    };
    wire::Window {
        gages: means.gages.into_iter().map(|one| one.map(gage)).collect(),
        cylinders: means.cylinders.into_iter().map(|one| one.map(cylinder)).collect(),
    }
}

fn from_window(window: wire::Window, length: WindowLength, until: Step) -> WindowMeans {
    let gage = |wire::GageWindow { residual_m, scatter_m2, swing_m2 }| GageMeans {
        residual_m,
        scatter_m2,
        swing_m2,
    };
    let cylinder = |wire::CylinderWindow { force_n, rate_n_per_s, tracking_n, content_pa }| {
        CylinderMeans { force_n, rate_n_per_s, tracking_n, content_pa }
    };
    WindowMeans {
        length,
        until,
        gages: window.gages.into_iter().map(|one| one.map(gage)).collect(),
        cylinders: window.cylinders.into_iter().map(|one| one.map(cylinder)).collect(),
    }
}

fn to_alarm(alarm: diagnosis::Alarm) -> wire::Alarm {
    let diagnosis::Alarm { component, step, faulty } = alarm;
    wire::Alarm { component, step, faulty }
}

fn from_alarm(alarm: wire::Alarm) -> diagnosis::Alarm {
    let wire::Alarm { component, step, faulty } = alarm;
    diagnosis::Alarm { component, step, faulty }
}

/// The word for a verdict.
#[must_use]
pub fn to_state(verdict: &Verdict) -> FaultState {
    match verdict {
        Verdict::Normal => FaultState::Normal,
        Verdict::Tentative => FaultState::Tentative,
        Verdict::Unconfirmed { .. } => FaultState::Unconfirmed,
        Verdict::Explained { .. } => FaultState::Explained,
        Verdict::Latched => FaultState::Latched,
        Verdict::Acknowledged => FaultState::Acknowledged,
    }
}

/// The word for a phase, and since which step it is in service.
#[must_use]
pub fn to_phase(phase: Phase) -> (ModulePhase, Option<Step>) {
    match phase {
        Phase::Waiting => (ModulePhase::Waiting, None),
        Phase::Initialising => (ModulePhase::Initialising, None),
        Phase::InService { since } => (ModulePhase::InService, Some(since)),
    }
}

/// The counters of a status.
#[must_use]
pub fn to_counters(counters: &Counters) -> wire::DiagnosisCounters {
    let Counters {
        samples,
        samples_missing,
        samples_repeated,
        samples_late,
        samples_far_ahead,
        samples_wrong_length,
        samples_non_finite,
        runs,
        restarts,
        changes,
        changes_unjudged,
        questions_asked,
        questions_unanswered,
        answers_malformed,
        verdicts_disputed,
        answers_given,
        questions_refused,
    } = *counters;
    wire::DiagnosisCounters {
        samples,
        samples_missing,
        samples_repeated,
        samples_late,
        samples_far_ahead,
        samples_wrong_length,
        samples_non_finite,
        runs,
        restarts,
        changes,
        changes_unjudged,
        questions_asked,
        questions_unanswered,
        answers_malformed,
        verdicts_disputed,
        answers_given,
        questions_refused,
    }
}
