//! A component's state as every view shows it: the one place that reads what a transition says of its verdict.

use serde::Serialize;
use vocabulary::words::{
    identified, printable, ratio, reason, residual, state_and_aside, state_in_words, state_tone,
};
use vocabulary::{
    ComponentPath, Condition, FaultState, FaultTransition, FreezeFrame, Identification, RunId,
    Step, StructureName, Symptom, Unknown,
};

use super::line::EventLine;
use super::row::{DetectionFacts, StateRow, Urgency};

impl StateRow {
    /// A component in its present state.
    #[must_use]
    pub fn of_component(state: &FaultTransition) -> Self {
        Self {
            structure: Some(state.structure.clone()),
            module: state.module.clone(),
            component: Some(state.component.clone()),
            urgency: urgency(state),
            tone: state_tone(state.state()),
            sign: sign(state),
            state: state_and_aside(state),
            is_set_aside: state.aside().is_some(),
            is_covered: false,
            since_unix_ns: since(state),
            kind: identification(state).map(identified).unwrap_or_default(),
            why: reason(state),
            unknown: Vec::new(),
            measured: measured(state),
        }
    }
}

/// A component that never had a transition has the time of the answer, which is no beginning.
fn since(state: &FaultTransition) -> Option<u64> {
    let of_state = (state.sequence > 0).then_some(state.since_unix_ns);
    let unknown = state.unknown.as_ref().filter(|_| state.state() == FaultState::Unknown);
    unknown.map_or(of_state, |unknown| Some(unknown.since_unix_ns))
}

/// What kind of fault a component has, if it has one that was identified.
#[must_use]
pub fn identification(state: &FaultTransition) -> Option<&Identification> {
    state.identification.as_deref().filter(|_| state.state().is_fault())
}

/// What explains its change, if that is so.
#[must_use]
pub fn explained_by(state: &FaultTransition) -> Option<&ComponentPath> {
    state.verdict.explained_by()
}

fn urgency(state: &FaultTransition) -> Urgency {
    let urgency = match state.state() {
        FaultState::Latched => Urgency::Latched,
        FaultState::Unconfirmed => Urgency::Unconfirmed,
        FaultState::Unknown => Urgency::Unknown,
        FaultState::Acknowledged => Urgency::Acknowledged,
        FaultState::Explained => Urgency::Explained,
        FaultState::Tentative => Urgency::Tentative,
        FaultState::Normal => Urgency::Normal,
    };
    let is_set_aside = urgency.needs_attention() && state.aside().is_some();
    if is_set_aside { Urgency::SetAside } else { urgency }
}

fn sign(state: &FaultTransition) -> &'static str {
    match state.state() {
        FaultState::Normal if !state.is_verified() => "unverified",
        known => known.as_str(),
    }
}

fn measured(state: &FaultTransition) -> DetectionFacts {
    // What was last computed says nothing of a component without a signal.
    let evidence = state.evidence.as_ref().filter(|_| state.symptom == Symptom::Change);
    let kind = state.component.component.kind();
    DetectionFacts {
        run: state.run,
        onset_step: state.onset_step.filter(|_| state.state() != FaultState::Normal),
        detection_step: state.detection_step,
        decided_step: state.decided_step,
        residual: evidence.map(|evidence| residual(kind, evidence.residual)),
        divergence: evidence.map(|evidence| ratio(evidence.ratio())),
        reference: Some(reference(state.condition.as_ref())),
    }
}

/// How a component compares with its reference.
fn reference(condition: Option<&Condition>) -> String {
    let Some(condition) = condition else { return "not known".to_owned() };
    let words = match condition {
        Condition::NotVerified => "no reference",
        Condition::NotCompared => "not compared yet",
        Condition::Agrees { .. } => "agrees",
        Condition::Doubtful { .. } => "departs in the latest window",
        Condition::Departed { .. } => "departed from",
        Condition::OneOf { .. } => "it or another component has departed from it",
        Condition::CannotTell { .. } => "cannot be compared at present",
    };
    let why = condition.reason().map(|why| format!(": {}", printable(&why)));
    format!("{words}{}", why.unwrap_or_default())
}

/// A component and its state in a line.
#[must_use]
pub fn title(state: &FaultTransition) -> String {
    let words = [
        Some(state_in_words(state)),
        identification(state).map(identified),
        vocabulary::words::aside(state),
    ];
    format!("{}: {}", state.component, words.into_iter().flatten().collect::<Vec<_>>().join("; "))
}

impl EventLine {
    /// A transition, as it was published or as a journal has it.
    #[must_use]
    pub fn of_transition(transition: &FaultTransition) -> Self {
        let began = match transition.symptom {
            Symptom::Change => {
                transition.detection_step.map(|step| format!("changed at step {step}"))
            }
            Symptom::NoSignal => transition.onset_step.map(|step| format!("since step {step}")),
            // Their reason says since when.
            Symptom::Departure | Symptom::OilContent | Symptom::Scatter => None,
        };
        // What an operator ordered is the news, not when the change was that came before.
        let began = began
            .filter(|_| transition.state() != FaultState::Normal && transition.order.is_none());
        let why = Some(reason(transition)).filter(|reason| !reason.is_empty());
        Self {
            time_unix_ns: transition.time_unix_ns,
            structure: Some(transition.structure.clone()),
            module: Some(transition.module.clone()),
            component: Some(transition.component.clone()),
            who: transition.component.to_string(),
            what: transition.state().to_string(),
            why: began.into_iter().chain(why).collect::<Vec<_>>().join("; "),
            tone: state_tone(transition.state()),
            // A transition does not say how the component compares with its reference.
            sign: if transition.state() == FaultState::Normal {
                "unverified"
            } else {
                transition.state().as_str()
            },
            step: transition.decided_step,
        }
    }
}

/// How many components are in each state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Faults that no operator has acknowledged.
    pub latched: usize,
    /// Faults that an operator has acknowledged.
    pub acknowledged: usize,
    /// Possible faults.
    pub unconfirmed: usize,
    /// A moment after a change.
    pub tentative: usize,
    /// Changes that another component's fault explains.
    pub explained: usize,
    /// Nothing is known of them.
    pub unknown: usize,
    /// Without a change.
    pub normal: usize,
    /// Those of the normal ones that agree with their reference.
    pub verified: usize,
    /// Those of any state whose alarm is shelved or suppressed.
    pub set_aside: usize,
}

impl Counts {
    /// Counts these components.
    pub fn of<'a>(components: impl IntoIterator<Item = &'a FaultTransition>) -> Self {
        let mut counts = Self::default();
        for component in components {
            let of_state = match component.state() {
                FaultState::Latched => &mut counts.latched,
                FaultState::Acknowledged => &mut counts.acknowledged,
                FaultState::Unconfirmed => &mut counts.unconfirmed,
                FaultState::Tentative => &mut counts.tentative,
                FaultState::Explained => &mut counts.explained,
                FaultState::Unknown => &mut counts.unknown,
                FaultState::Normal => &mut counts.normal,
            };
            *of_state += 1;
            let is_verified = component.state() == FaultState::Normal && component.is_verified();
            counts.verified += usize::from(is_verified);
            counts.set_aside += usize::from(component.aside().is_some());
        }
        counts
    }

    /// All of them.
    #[must_use]
    pub fn total(&self) -> usize {
        let Self {
            latched, acknowledged, unconfirmed, tentative, explained, unknown, normal, ..
        } = self;
        latched + acknowledged + unconfirmed + tentative + explained + unknown + normal
    }

    /// In words, the normal ones first.
    #[must_use]
    pub fn words(&self) -> String {
        let (total, verified) = (self.total(), self.verified);
        if total == 0 {
            return "all components unknown".to_owned();
        }
        let unverified = self.normal - verified;
        let first = match verified {
            0 if unverified > 0 => {
                format!("{unverified} of {total} components are normal, not verified")
            }
            _ => format!("{verified} of {total} components are normal"),
        };
        let others = [
            (self.latched, "latched"),
            (self.acknowledged, "acknowledged"),
            (self.unconfirmed, "unconfirmed"),
            (self.unknown, "unknown"),
            (self.tentative, "tentative"),
            (self.explained, "explained"),
            (if verified > 0 { unverified } else { 0 }, "normal but not verified"),
            (self.set_aside, "shelved or suppressed"),
        ];
        let others = others.iter().filter(|(count, _)| *count > 0);
        let others = others.map(|(count, what)| format!("{count} {what}"));
        std::iter::once(first).chain(others).collect::<Vec<_>>().join(", ")
    }
}

/// Takes the state of a component unless it is older than what is known.
pub(super) fn enter(components: &mut Vec<FaultTransition>, state: FaultTransition) {
    match components.binary_search_by(|known| known.component.cmp(&state.component)) {
        Ok(place) if components[place].place() <= state.place() => components[place] = state,
        Ok(_) => {}
        Err(place) => components.insert(place, state),
    }
}

/// Takes note that a message on the state of a component cannot be read.
pub(super) fn unreadable(
    components: &mut Vec<FaultTransition>,
    structure: StructureName,
    component: ComponentPath,
    unknown: Unknown,
) {
    match components.binary_search_by(|known| known.component.cmp(&component)) {
        Ok(place) => silence(&mut components[place], &unknown),
        Err(place) => {
            let state = FaultTransition::untouched(structure, component, unknown.since_unix_ns);
            components.insert(place, state.while_unknown(unknown));
        }
    }
}

/// Takes what kind of fault a component has.
pub(super) fn identify(components: &mut [FaultTransition], found: &Identification) {
    if let Some(known) = components.iter_mut().find(|known| known.component == found.component) {
        known.identification = Some(Box::new(found.clone()));
    }
}

/// Nothing is known of a component while its module does not monitor it, nor if the condition that comes with its state
/// does not allow to call it normal. A diagnoser answers *unknown* then, but what a view shows does not rest on that.
pub(super) fn doubt(state: &mut FaultTransition, lack: Option<&Unknown>) {
    if state.state() == FaultState::Normal
        && let Some(unknown) = lack.cloned().or_else(|| unverifiable(state))
    {
        silence(state, &unknown);
    }
}

fn unverifiable(state: &FaultTransition) -> Option<Unknown> {
    let condition = state.condition.as_ref().filter(|known| !known.allows_normal())?;
    let reason = condition.reason().unwrap_or_else(|| reference(Some(condition)));
    Some(Unknown { since_unix_ns: state.time_unix_ns, reason })
}

/// The same of a module that does not answer: of a fault it is said, too.
pub(super) fn silence(state: &mut FaultTransition, unknown: &Unknown) {
    *state = state.clone().while_unknown(unknown.clone());
}

/// Whether a freeze frame is of the fault that a component has. An acknowledgement is a transition of its own, on the same
/// onset.
pub(crate) fn is_frame_of(frame: &FreezeFrame, found: &FaultTransition) -> bool {
    frame.component == found.component
        && frame.incarnation == found.incarnation
        && found.run.is_none_or(|run| run == frame.signals.run)
        && Some(frame.signals.onset_step) == found.onset_step
        && frame.signals.sequence <= found.sequence
}

/// Run and step as of which it was found. An order has only its time: it comes long after the latest step, perhaps.
pub(super) fn found_at(transition: &FaultTransition) -> Option<(RunId, Step)> {
    let found = transition.run.zip(transition.decided_step);
    found.filter(|_| transition.order.is_none())
}

/// Whether nothing is known of it because its module does not monitor it.
pub(super) fn is_unmonitored(state: &FaultTransition) -> bool {
    state.state() == FaultState::Unknown && state.unknown.is_some()
}

/// The alarms of all these components are suppressed: the suppression that ends first.
pub(super) fn suppression(components: &[FaultTransition]) -> Option<&vocabulary::Shelving> {
    let suppressed = components.iter().map(|component| component.suppressed.as_ref());
    let suppressed: Option<Vec<_>> = suppressed.collect();
    suppressed?.into_iter().min_by_key(|shelving| shelving.until_unix_ns)
}
