//! The state of a component as every view shows it; the only code that interprets the verdict in a transition.

use serde::Serialize;
use vocabulary::words::{
    at_detection, identified, present_reason, printable, reason, state_and_aside, state_in_words,
    state_tone,
};
use vocabulary::{
    ComponentPath, Condition, FaultState, FaultTransition, FreezeFrame, Identification, RunId,
    Step, StructureName, Symptom, Unknown,
};

use super::line::{EventLine, FOUND};
use super::row::{DetectionFacts, StateRow, Urgency};

impl StateRow {
    /// The row of a component in its present state.
    #[must_use]
    pub fn of_component(state: &FaultTransition) -> Self {
        Self {
            structure: Some(state.structure.clone()),
            module: state.module.clone(),
            component: Some(state.component.clone()),
            urgency: urgency(state),
            tone: state_tone(state.state()),
            sign: sign(state),
            state: standing(state),
            is_set_aside: state.aside().is_some(),
            is_covered: false,
            since_unix_ns: since(state),
            kind: identification(state).map(identified).unwrap_or_default(),
            why: present_reason(state),
            groups: Vec::new(),
            incident: incident(state),
            measured: measured(state),
        }
    }
}

/// The state in words; of a fault that is gone, that it can be reset.
fn standing(state: &FaultTransition) -> String {
    let words = state_and_aside(state);
    let is_present = state.state().is_fault() && !state.is_last_known();
    let is_gone = is_present && state.is_verified() && state.shut_off.is_none();
    if is_gone { format!("{words}, ready to reset") } else { words }
}

/// When the present state began, whatever was ordered later; not known before the first change.
fn since(state: &FaultTransition) -> Option<u64> {
    // Without a transition the message's time is that of the reply.
    let of_state = Some(state.since_unix_ns).filter(|since| state.sequence > 0 && *since > 0);
    let unknown = state.unknown.as_ref().filter(|_| state.state() == FaultState::Unknown);
    unknown.map_or(of_state, |unknown| Some(unknown.since_unix_ns))
}

/// The number of the incident that a fault or a possible fault is.
pub(super) fn incident(state: &FaultTransition) -> Option<String> {
    if !state.state().is_fault() && state.state() != FaultState::Unconfirmed {
        return None;
    }
    let (structure, component) = (&state.structure, &state.component);
    let detected = state.run.zip(state.detection_step.or(state.onset_step));
    Some(match detected {
        Some((run, step)) => format!("{structure}/{component}@{run}-{step}"),
        // A person declared it.
        None => format!("{structure}/{component}@{}", state.since_unix_ns / 1_000_000),
    })
}

/// What kind of fault a component has, if it has one that was identified.
#[must_use]
pub fn identification(state: &FaultTransition) -> Option<&Identification> {
    state.identification.as_deref().filter(|_| state.state().is_fault())
}

/// The component whose fault explains this one's change, if any.
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
    // A normal or unknown component's last change has ended: its steps belong in the list of events.
    if matches!(state.state(), FaultState::Normal | FaultState::Unknown) {
        let reference = Some(reference(state.condition.as_ref()));
        return DetectionFacts { reference, ..DetectionFacts::default() };
    }
    DetectionFacts {
        run: state.run,
        onset_step: state.onset_step,
        detection_step: state.detection_step,
        decided_step: state.decided_step,
        at_detection: at_detection(state),
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

/// A component and its state on one line.
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
    /// The row of a transition, published or from a journal.
    #[must_use]
    pub fn of_transition(transition: &FaultTransition) -> Self {
        let began = match transition.symptom {
            Symptom::Change => {
                transition.detection_step.map(|step| format!("changed at step {step}"))
            }
            Symptom::NoSignal => transition.onset_step.map(|step| format!("since step {step}")),
            // The text of the reason includes the onset.
            Symptom::Departure | Symptom::OilContent | Symptom::Scatter | Symptom::Reading => None,
        };
        // After an order the news is the order, not the onset of the earlier change.
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
            // A transition does not include the comparison with the reference.
            sign: if transition.state() == FaultState::Normal {
                "unverified"
            } else {
                transition.state().as_str()
            },
            step: decided(transition),
        }
    }

    /// The row of a component's state that was there when the view connected, by the time since when.
    #[must_use]
    pub fn of_present(state: &FaultTransition) -> Self {
        let since = StateRow::of_component(state).since_unix_ns.unwrap_or(state.time_unix_ns);
        let kind = identification(state).map(identified);
        let reason = Some(present_reason(state)).filter(|reason| !reason.is_empty());
        let why = [Some(FOUND.to_owned()), kind, reason];
        Self {
            time_unix_ns: since,
            what: state_and_aside(state),
            why: why.into_iter().flatten().collect::<Vec<_>>().join("; "),
            sign: sign(state),
            ..Self::of_transition(state)
        }
    }
}

/// Whether a state is worth a line when a view connects: what is not normal, and what is shelved or suppressed. Of what is
/// not monitored the module's phase speaks.
pub(super) fn is_noteworthy(state: &FaultTransition) -> bool {
    state.aside().is_some() || !matches!(state.state(), FaultState::Normal | FaultState::Unknown)
}

/// Says why a component without a declared fault has no freeze frame.
#[must_use]
pub fn why_no_fault(state: &FaultTransition) -> &'static str {
    match state.state() {
        FaultState::Unknown => "whether it has a fault is not known",
        _ => "no fault is declared",
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
    /// Components whose state is unknown.
    pub unknown: usize,
    /// Components without a change.
    pub normal: usize,
    /// Normal components that agree with their reference.
    pub verified: usize,
    /// Components in any state whose alarm is shelved or suppressed.
    pub set_aside: usize,
    /// Components in a state that their module does not monitor at present: the last known one.
    pub last_known: usize,
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
            counts.last_known += usize::from(component.is_last_known());
        }
        counts
    }

    /// The number of all components.
    #[must_use]
    pub fn total(&self) -> usize {
        let Self {
            latched, acknowledged, unconfirmed, tentative, explained, unknown, normal, ..
        } = self;
        latched + acknowledged + unconfirmed + tentative + explained + unknown + normal
    }

    /// The normal ones in a table: how many of how many.
    #[must_use]
    pub fn normal_of_total(&self) -> String {
        format!("{} of {}{}", self.normal, self.total(), self.not_verified())
    }

    /// How many of the normal ones do not agree with a reference, if any.
    fn not_verified(&self) -> String {
        match self.normal - self.verified {
            0 => String::new(),
            all if all == self.normal => ", not verified".to_owned(),
            some => format!(" ({some} not verified)"),
        }
    }

    /// In words, the normal ones first.
    #[must_use]
    pub fn words(&self) -> String {
        let total = self.total();
        if total == 0 {
            return "all components unknown".to_owned();
        }
        let (normal, not_verified) = (self.normal, self.not_verified());
        let first = format!("{normal} of {total} components are normal{not_verified}");
        let others = [
            (self.latched, "latched"),
            (self.acknowledged, "acknowledged"),
            (self.unconfirmed, "unconfirmed"),
            (self.unknown, "unknown"),
            (self.tentative, "tentative"),
            (self.explained, "explained"),
            (self.set_aside, "shelved or suppressed"),
            (self.last_known, "last known"),
        ];
        let others = others.iter().filter(|(count, _)| *count > 0);
        let others = others.map(|(count, what)| format!("{count} {what}"));
        std::iter::once(first).chain(others).collect::<Vec<_>>().join(", ")
    }
}

/// Most components of a module, because a client can invent names.
pub(super) const COMPONENTS: usize = 1024;

/// Stores the state of a component unless a later one is stored; false if it is a new one beyond [`COMPONENTS`]. A
/// transition does not include the comparison with the reference: the known one holds, unless it is of a time before the
/// change.
pub(super) fn enter(components: &mut Vec<FaultTransition>, mut state: FaultTransition) -> bool {
    match components.binary_search_by(|known| known.component.cmp(&state.component)) {
        Ok(place) if is_later(&state, &components[place]) => {
            let known = &mut components[place];
            state.condition = state.condition.or_else(|| known.condition.take());
            let orders = state.order.iter().chain(state.state_order.as_deref());
            let is_of_change = state.state() != FaultState::Normal
                || orders.into_iter().any(|order| order.kind.is_about_verdict());
            if let Some(Condition::Agrees { from, .. }) = state.condition
                && state.detection_step.is_some_and(|detected| from <= detected)
                && is_of_change
                && !state.run_ended
            {
                state.condition = Some(Condition::NotCompared);
            }
            *known = state;
        }
        Ok(_) => {}
        Err(_) if components.len() >= COMPONENTS => return false,
        Err(place) => components.insert(place, state),
    }
    true
}

/// Is this the state of a component after the other? A process that lost what no disk had gives its numbers again.
fn is_later(state: &FaultTransition, known: &FaultTransition) -> bool {
    let counts_again =
        state.incarnation == known.incarnation && state.time_unix_ns > known.time_unix_ns;
    state.place() >= known.place() || counts_again
}

/// What was known of the comparison with the reference does not hold any more.
pub(super) fn outdate(components: &mut [FaultTransition]) {
    for state in components {
        if let Some(known @ Condition::Agrees { .. }) = &mut state.condition {
            *known = Condition::NotCompared;
        }
    }
}

/// Records that a message about a component's state could not be read; false if it is a new one beyond [`COMPONENTS`].
pub(super) fn unreadable(
    components: &mut Vec<FaultTransition>,
    structure: StructureName,
    component: ComponentPath,
    unknown: Unknown,
) -> bool {
    match components.binary_search_by(|known| known.component.cmp(&component)) {
        Ok(place) => silence(&mut components[place], &unknown),
        Err(_) if components.len() >= COMPONENTS => return false,
        Err(place) => {
            let state = FaultTransition::untouched(structure, component, unknown.since_unix_ns);
            components.insert(place, state.while_unknown(unknown));
        }
    }
    true
}

/// Stores the identified kind of a component's fault.
pub(super) fn identify(components: &mut [FaultTransition], found: &Identification) {
    if let Some(known) = components.iter_mut().find(|known| known.component == found.component) {
        known.identification = Some(Box::new(found.clone()));
    }
}

/// Marks a component as unknown while its module does not monitor it, or if its condition does not permit calling it
/// normal. A diagnoser answers *unknown* then too, but views do not depend on that.
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

/// Marks a component of a module that does not answer as unknown, even if it has a fault.
pub(super) fn silence(state: &mut FaultTransition, unknown: &Unknown) {
    *state = state.clone().while_unknown(unknown.clone());
}

/// Whether a freeze frame belongs to a component's present fault. An acknowledgement is a separate transition with the
/// same onset.
pub fn is_frame_of(frame: &FreezeFrame, found: &FaultTransition) -> bool {
    frame.component == found.component
        && frame.incarnation == found.incarnation
        && found.run.is_none_or(|run| run == frame.signals.run)
        && Some(frame.signals.onset_step) == found.onset_step
        && frame.signals.sequence <= found.sequence
}

/// Run and step as of which the state was found.
pub(super) fn found_at(transition: &FaultTransition) -> Option<(RunId, Step)> {
    transition.run.zip(decided(transition))
}

/// The step of that. An order has only a time: it may arrive long after the latest step.
fn decided(transition: &FaultTransition) -> Option<Step> {
    transition.decided_step.filter(|_| transition.order.is_none())
}

/// Whether the state is unknown because the module does not monitor the component.
pub(super) fn is_unmonitored(state: &FaultTransition) -> bool {
    state.state() == FaultState::Unknown && state.unknown.is_some()
}

/// If the alarms of all these components are suppressed, the suppression that ends first.
pub(super) fn suppression(components: &[FaultTransition]) -> Option<&vocabulary::Shelving> {
    let suppressed = components.iter().map(|component| component.suppressed.as_ref());
    let suppressed: Option<Vec<_>> = suppressed.collect();
    suppressed?.into_iter().min_by_key(|shelving| shelving.until_unix_ns)
}
