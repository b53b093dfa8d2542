//! The present state of each component of a module; the only source for the journal, replies to queries, the status,
//! the metrics and the memory after a restart.
//!
//! A new journal file begins with [`ComponentStore::snapshot`]; after a restart [`ComponentStore::restore`] reads those
//! records.

use std::collections::{BTreeMap, VecDeque};

use diagnosis::messages::{Speaker, from_transition};
use diagnosis::{MAX_CHANGES_IN_ANSWER, Memory, PastWatch};
use vocabulary::{
    Ability, Change, Component, ComponentPath, Condition, CylinderCapability, FaultState,
    FaultTransition, Identification, IdentifiedKind, Input, ModuleName, ModulePhase, PhaseChange,
    ReplacedReading, RunId, Shelving, Unknown, fault::FaultKind,
};

use crate::identified_fault::IdentifiedFault;
use crate::record::{JournalRecord, WatchedSteps};

/// Most changes in the snapshot at the beginning of a journal file.
const CHANGES: usize = 512;
/// Most inputs of earlier processes in that snapshot.
const INPUTS: usize = 128;
/// Most inputs written before a transition. Earlier ones were published long ago.
const INPUTS_OF_TRANSITION: usize = 64;

/// The present state of a module.
#[derive(Debug, Default)]
pub struct ComponentStore {
    /// The module's own components in the order of its channels, followed by components known only from the journal:
    /// those of another module or of an earlier configuration.
    entries: Vec<StoredComponent>,
    own: usize,
    /// The latest changes in the present run.
    changes: VecDeque<(RunId, Change)>,
    /// The latest inputs in the journal.
    inputs: VecDeque<Input>,
    /// Inputs since the latest transition; they are written to the journal with the next one.
    inputs_since: VecDeque<Input>,
    /// Whether a run has ended, so that earlier records in the journal belong to an earlier run.
    run_ended: bool,
    start: Option<JournalRecord>,
    /// The highest sequence number of the module's transitions, and the incarnation that it belongs to \[ms since
    /// 1970\].
    sequence: u64,
    incarnation: u64,
    /// The latest change of phase of this process; `None` before the first.
    phase: Option<PhaseChange>,
    /// The latest one in the journal.
    journalled_phase: Option<PhaseChange>,
    /// Since when and why components are not monitored, if so.
    unmonitored: Option<Unknown>,
}

#[derive(Debug)]
struct StoredComponent {
    path: ComponentPath,
    latest: Option<FaultTransition>,
    /// The ticket that tells whether its record is durable.
    ticket: u64,
    fault: IdentifiedFault,
    /// The comparison with its reference, and since when that does not permit calling it normal.
    condition: Option<Condition>,
    /// Of a faulty gage, what it should read.
    reading: Option<ReplacedReading>,
    hidden_since_ns: Option<u64>,
}

/// The state of a component as sent in replies.
#[derive(Debug, Clone, PartialEq)]
pub struct PublishedState {
    /// The component.
    pub component: Component,
    /// Its state.
    pub state: FaultTransition,
    /// The ticket that tells whether its latest transition is durable.
    pub ticket: u64,
}

/// The state of a component for status and metrics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PresentComponent<'a> {
    /// The component.
    pub component: &'a Component,
    /// Its state.
    pub state: FaultState,
    /// Its latest transition, if there is one.
    pub latest: Option<&'a FaultTransition>,
    /// The comparison with its reference.
    pub condition: Option<&'a Condition>,
}

impl ComponentStore {
    /// Restores the state from the records of a journal, oldest first. Records of other modules are kept for the
    /// journal only.
    #[must_use]
    pub fn restore(records: Vec<JournalRecord>, module: &ModuleName, now_unix_ns: u64) -> Self {
        let mut store = Self::default();
        let mut stated = None;
        for record in records {
            match record {
                JournalRecord::Transition(transition) => {
                    if transition.module == *module {
                        stated = stated.max(Some(transition.incarnation));
                        store.sequence = store.sequence.max(transition.sequence);
                    }
                    let entry = store.entry(&transition.component);
                    entry.fault.enter(&transition);
                    entry.take(*transition, 0);
                }
                JournalRecord::Identification(found) => {
                    store.entry(&found.component).fault.recall(*found);
                }
                JournalRecord::Phase(change) if change.module == *module => {
                    store.journalled_phase = Some(*change);
                }
                other => {
                    if let JournalRecord::Start { incarnation, .. } = other {
                        stated = stated.max(Some(incarnation));
                    }
                    store.note(other);
                }
            }
        }
        store.incarnation = stated.unwrap_or(now_unix_ns / 1_000_000);
        store
    }

    /// The incarnation that sequence numbers belong to: that of the journal, or a new one \[ms since 1970\].
    #[must_use]
    pub fn incarnation(&self) -> u64 {
        self.incarnation
    }

    /// Sets the module's own components in the order of its channels. They are unmonitored at first, for this reason.
    pub fn configure(
        &mut self,
        module: &ModuleName,
        components: &[Component],
        reason: String,
        now_unix_ns: u64,
    ) {
        let mut known = std::mem::take(&mut self.entries);
        for component in components {
            let path = ComponentPath { module: module.clone(), component: component.clone() };
            let place = known.iter().position(|entry| entry.path == path);
            let entry = place.map(|place| known.remove(place));
            self.entries.push(entry.unwrap_or_else(|| StoredComponent::new(path)));
        }
        self.own = self.entries.len();
        self.entries.append(&mut known);
        self.unmonitored = Some(Unknown { since_unix_ns: now_unix_ns, reason });
    }

    /// Records a transition whose journal record has this ticket. Returns it with the identification of its fault.
    pub fn transition(&mut self, mut transition: FaultTransition, ticket: u64) -> FaultTransition {
        let entry = self.entry(&transition.component);
        entry.fault.enter(&transition);
        transition.identification = entry.fault.latest().map(carried);
        match &entry.latest {
            Some(before) if transition.continues(before) => {
                transition.since_unix_ns = before.since_unix_ns;
            }
            // Its alarm alone was shelved or suppressed.
            None if transition.state() == FaultState::Normal => transition.since_unix_ns = 0,
            _ => {}
        }
        entry.take(transition.clone(), ticket);
        transition
    }

    /// Records an input.
    pub fn input(&mut self, input: Input) {
        push_within(&mut self.inputs_since, input, INPUTS_OF_TRANSITION);
    }

    /// The inputs since the latest transition, oldest first, to be written before the next transition.
    pub fn inputs_of_transition(&mut self) -> Vec<JournalRecord> {
        let inputs: Vec<Input> = self.inputs_since.drain(..).collect();
        inputs.iter().for_each(|input| push_within(&mut self.inputs, input.clone(), INPUTS));
        inputs.into_iter().map(|input| JournalRecord::Input(Box::new(input))).collect()
    }

    /// What each cylinder can still do, in the order of the channels; `leak_ends_in_s` tells when a leak of this kind ends
    /// one.
    pub fn capability(
        &self,
        leak_ends_in_s: impl Fn(&Component, FaultKind) -> Option<f64>,
    ) -> impl Iterator<Item = CylinderCapability> {
        self.own().zip(self.present()).filter_map(move |(entry, present)| {
            let component = &entry.path.component;
            let Component::Actuator(name) = component else { return None };
            let name = name.clone();
            let (ability, decided) = match present.state {
                _ if present.latest.is_some_and(|latest| latest.shut_off.is_some()) => {
                    (Ability::ShutOff, true)
                }
                FaultState::Latched | FaultState::Acknowledged => {
                    let known = entry.fault.latest();
                    let mut faulty = CylinderCapability::of_faulty(name, known);
                    if let Some(IdentifiedKind::Known(kind)) =
                        known.and_then(Identification::kind).map(|candidate| candidate.kind)
                    {
                        let ends_in_s = leak_ends_in_s(component, kind);
                        faulty.ends_in_s = ends_in_s.map(|seconds| seconds.round() as u64);
                    }
                    return Some(faulty);
                }
                FaultState::Tentative | FaultState::Unconfirmed | FaultState::Unknown => {
                    (Ability::Unknown, false)
                }
                FaultState::Normal | FaultState::Explained => (Ability::Full, true),
            };
            Some(CylinderCapability { name, ability, decided, ends_in_s: None })
        })
    }

    /// The module's latest inputs in the journal, oldest first.
    pub fn inputs(&self, module: &ModuleName) -> impl Iterator<Item = &Input> {
        self.inputs.iter().filter(move |input| input.module == *module)
    }

    /// Records an identification. Returns it if it is to be published, and `None` if it adds nothing new or belongs to
    /// an earlier fault.
    pub fn identification(&mut self, found: Identification) -> Option<Identification> {
        self.entry(&found.component).fault.find(found)
    }

    /// Records other journal records.
    pub fn note(&mut self, record: JournalRecord) {
        match record {
            JournalRecord::Change { run, change } => {
                push_within(&mut self.changes, (run, change), CHANGES);
            }
            JournalRecord::RunEnded => {
                self.changes.clear();
                self.run_ended = true;
                let latest = self.entries.iter_mut().filter_map(|entry| entry.latest.as_mut());
                latest.for_each(|latest| latest.run_ended = true);
            }
            JournalRecord::Start { .. } => self.start = Some(record),
            JournalRecord::Input(input) => push_within(&mut self.inputs, *input, INPUTS),
            JournalRecord::Transition(_)
            | JournalRecord::Identification(_)
            | JournalRecord::Phase(_) => {}
        }
    }

    /// Records the present conditions, in the order of the channels.
    pub fn conditions(&mut self, present: impl IntoIterator<Item = Condition>, now_unix_ns: u64) {
        for (entry, condition) in self.entries.iter_mut().zip(present) {
            let is_hidden = !condition.allows_normal();
            // A condition that persists keeps the time at which it was first seen.
            let since = entry.hidden_since_ns.unwrap_or(now_unix_ns);
            entry.hidden_since_ns = is_hidden.then_some(since);
            entry.condition = Some(condition);
        }
    }

    /// Records what faulty gages read, and should read.
    pub fn readings<'a>(
        &mut self,
        replaced: impl IntoIterator<Item = (&'a Component, ReplacedReading)>,
    ) {
        let mut replaced: BTreeMap<_, _> = replaced.into_iter().collect();
        for entry in &mut self.entries[..self.own] {
            entry.reading = replaced.remove(&entry.path.component);
        }
    }

    /// Records a change of phase. Returns it with its number.
    pub fn phase_changed(&mut self, mut change: PhaseChange) -> PhaseChange {
        change.number = self.journalled_phase.as_ref().map_or(1, |latest| latest.number + 1);
        self.journalled_phase = Some(change.clone());
        self.phase = Some(change.clone());
        change
    }

    /// The components without a fault that cannot be compared with their references, and why. Those that have not been
    /// compared yet, or depart from their references, are monitored.
    #[must_use]
    pub fn not_monitored(&self) -> BTreeMap<ComponentPath, String> {
        let lost = |entry: &StoredComponent| {
            let condition = entry.condition.as_ref()?;
            let is_lost = matches!(condition, Condition::CannotTell { .. })
                && entry.latest.as_ref().is_none_or(|known| known.state() == FaultState::Normal);
            let reason = condition.reason().filter(|_| is_lost)?;
            Some((entry.path.clone(), reason))
        };
        self.own().filter_map(lost).collect()
    }

    /// Records the present phase and its reason. A phase that persists keeps the time at which it was entered. What agreed
    /// before the module left service has to be compared again.
    pub fn monitored(&mut self, phase: ModulePhase, reason: String, now_unix_ns: u64) {
        if phase != ModulePhase::InService && self.unmonitored.is_none() {
            let agreeing = self
                .entries
                .iter_mut()
                .filter(|entry| matches!(entry.condition, Some(Condition::Agrees { .. })));
            for entry in agreeing {
                entry.condition = Some(Condition::NotCompared);
                entry.hidden_since_ns = Some(now_unix_ns);
            }
        }
        let since = self.unmonitored.as_ref().map_or(now_unix_ns, |known| known.since_unix_ns);
        let unknown = Unknown { since_unix_ns: since, reason };
        self.unmonitored = (phase != ModulePhase::InService).then_some(unknown);
    }

    /// The latest change of phase.
    #[must_use]
    pub fn phase(&self) -> Option<&PhaseChange> {
        self.phase.as_ref()
    }

    /// The states of the selected components for a reply. A component that is not monitored or cannot be verified is
    /// reported as unknown, not as normal. `stuck` gives the reason if nothing is known in any phase.
    pub fn states(
        &self,
        speaker: &Speaker,
        wanted: impl Fn(&Component) -> bool,
        stuck: Option<Unknown>,
        now_unix_ns: u64,
    ) -> Vec<PublishedState> {
        let unknown = stuck.or_else(|| self.unmonitored.clone());
        let wanted = self.own().filter(|entry| wanted(&entry.path.component));
        let state = |entry: &StoredComponent| PublishedState {
            component: entry.path.component.clone(),
            state: entry.state(speaker, unknown.as_ref(), now_unix_ns),
            ticket: entry.ticket,
        };
        wanted.map(state).collect()
    }

    /// The latest identification of each selected component with a fault.
    pub fn identifications(
        &self,
        wanted: impl Fn(&Component) -> bool,
    ) -> impl Iterator<Item = &Identification> {
        let wanted = self.own().filter(move |entry| wanted(&entry.path.component));
        wanted.filter_map(|entry| entry.fault.latest())
    }

    /// Everything published before the restart: the latest transition of each component, and the identification of its
    /// fault.
    #[must_use]
    pub fn published(&self) -> (Vec<FaultTransition>, Vec<Identification>) {
        let transitions = self.own().filter_map(|entry| entry.latest.clone());
        let found = self.own().filter_map(|entry| entry.fault.published().cloned());
        (transitions.collect(), found.collect())
    }

    /// The present state of each component, in the order of the channels.
    pub fn present(&self) -> impl Iterator<Item = PresentComponent<'_>> {
        let is_hidden =
            |entry: &StoredComponent| self.unmonitored.is_some() || entry.hidden_since_ns.is_some();
        self.own().map(move |entry| {
            let state = match entry.latest.as_ref().map(FaultTransition::state) {
                None | Some(FaultState::Normal) if is_hidden(entry) => FaultState::Unknown,
                known => known.unwrap_or(FaultState::Normal),
            };
            let (component, latest) = (&entry.path.component, entry.latest.as_ref());
            PresentComponent { component, state, latest, condition: entry.condition.as_ref() }
        })
    }

    /// If all components are suppressed, the suppression that ends first.
    #[must_use]
    pub fn suppression(&self) -> Option<&Shelving> {
        let suppressed = |entry: &'_ StoredComponent| -> Option<u64> {
            Some(entry.latest.as_ref()?.suppressed.as_ref()?.until_unix_ns)
        };
        let is_of_all = self.own().all(|entry| suppressed(entry).is_some());
        let first = self.own().min_by_key(|entry| suppressed(entry)).filter(|_| is_of_all)?;
        first.latest.as_ref()?.suppressed.as_ref()
    }

    /// The memory passed to the diagnoser after a restart. `watch` names the run.
    #[must_use]
    pub fn memory(&self, module: &ModuleName, watch: Option<WatchedSteps>) -> Memory {
        let own = self.entries.iter().filter(|entry| entry.path.module == *module);
        let latest = own.filter_map(|entry| entry.latest.clone()).filter_map(from_transition);
        let watch = watch.map(|WatchedSteps { run, watched }| {
            let own = self.changes.iter().filter(|(of, _)| *of == run);
            // A change is written again when it ends, and repeated in a new file: the latest record applies.
            let mut latest = BTreeMap::new();
            for (_, change) in own {
                latest.insert((change.step, change.component.clone()), change.clone());
            }
            let mut changes: Vec<Change> = latest.into_values().collect();
            changes.drain(..changes.len().saturating_sub(MAX_CHANGES_IN_ANSWER));
            PastWatch { run, watched, changes }
        });
        Memory { sequence: self.sequence, latest: latest.collect(), watch }
    }

    /// The records at the beginning of a new journal file, in a readable order: the identification of a fault follows
    /// the fault.
    #[must_use]
    pub fn snapshot(&self) -> Vec<JournalRecord> {
        let start = self.start.iter().cloned();
        // The end of the run also applies to records in earlier files.
        let ended = self.run_ended.then_some(JournalRecord::RunEnded);
        let changes = self.changes.iter().cloned();
        let changes = changes.map(|(run, change)| JournalRecord::Change { run, change });
        let inputs = self.inputs.iter().cloned();
        let inputs = inputs.map(|input| JournalRecord::Input(Box::new(input)));
        let latest = self.entries.iter().filter_map(|entry| entry.latest.clone());
        let latest = latest.map(|latest| JournalRecord::Transition(Box::new(latest)));
        let found = self.entries.iter().filter_map(|entry| entry.fault.published().cloned());
        let found = found.map(|found| JournalRecord::Identification(Box::new(found)));
        let phase = self.journalled_phase.iter().cloned();
        let phase = phase.map(|change| JournalRecord::Phase(Box::new(change)));
        let transitions = latest.chain(found);
        start.chain(ended).chain(changes).chain(inputs).chain(phase).chain(transitions).collect()
    }

    fn own(&self) -> impl Iterator<Item = &StoredComponent> {
        self.entries[..self.own].iter()
    }

    fn entry(&mut self, path: &ComponentPath) -> &mut StoredComponent {
        let known = self.entries.iter().position(|entry| entry.path == *path);
        let place = known.unwrap_or_else(|| {
            self.entries.push(StoredComponent::new(path.clone()));
            self.entries.len() - 1
        });
        &mut self.entries[place]
    }
}

impl StoredComponent {
    fn new(path: ComponentPath) -> Self {
        let fault = IdentifiedFault::default();
        Self {
            path,
            latest: None,
            ticket: 0,
            fault,
            condition: None,
            reading: None,
            hidden_since_ns: None,
        }
    }

    /// The transition with the highest sequence number is the latest.
    fn take(&mut self, transition: FaultTransition, ticket: u64) {
        if self.latest.as_ref().is_none_or(|known| known.sequence <= transition.sequence) {
            self.latest = Some(transition);
            self.ticket = ticket;
        }
    }

    fn state(
        &self,
        speaker: &Speaker,
        unknown: Option<&Unknown>,
        now_unix_ns: u64,
    ) -> FaultTransition {
        let untouched = || speaker.untouched(&self.path.component, now_unix_ns);
        let mut state = self.latest.clone().unwrap_or_else(untouched);
        let latest = self.fault.latest().filter(|_| state.state().is_fault());
        state.identification = latest.map(carried);
        if let Some(unknown) = unknown {
            // That it agreed says nothing of the present.
            state.condition = match &self.condition {
                Some(Condition::Agrees { .. }) => Some(Condition::NotCompared),
                known => known.clone(),
            };
            return state.while_unknown(unknown.clone());
        }
        state.reading = self.reading.filter(|_| state.state().is_fault());
        let Some(condition) = &self.condition else { return state };
        state = match self.hidden_since_ns {
            Some(since_unix_ns) if state.state() == FaultState::Normal => {
                let reason = condition.reason().unwrap_or_default();
                state.while_unknown(Unknown { since_unix_ns, reason })
            }
            _ => state,
        };
        FaultTransition { condition: Some(condition.clone()), ..state }
    }
}

/// Appends to a list of the latest items, dropping the oldest beyond a limit.
fn push_within<T>(latest: &mut VecDeque<T>, item: T, most: usize) {
    if latest.len() == most {
        latest.pop_front();
    }
    latest.push_back(item);
}

/// The part of the latest identification that a transition includes.
fn carried(latest: &Identification) -> Box<Identification> {
    Box::new(latest.clone().without_signature())
}

#[cfg(test)]
mod tests;
