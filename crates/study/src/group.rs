//! Diagnosers of several modules in one process, whose queries of each other are answered at once.

use std::collections::{BTreeMap, VecDeque};

use diagnosis::identification::{Excerpt, IdentificationResult, identify};
use diagnosis::{
    Action, ActuatorFault, Change, Diagnoser, Event, GivenOrder, Measurements, Memory, ModuleSetup,
    OrderRefusal, OrderToken, PastWatch, PeerFailure, QuestionToken, SetupError, StateQuestion,
    Transition, Verdict,
};
use serde::{Deserialize, Serialize};
use vocabulary::{Component, ComponentPath, ModuleName, RunId, Step, fault::FaultKind};

/// An event of a module that the study records.
#[derive(Debug, Clone, PartialEq)]
pub enum RigEvent {
    /// A channel changed.
    Change {
        /// The module.
        module: ModuleName,
        /// The change.
        change: Change,
    },
    /// A peer answered a module's question.
    Question {
        /// The module that asked.
        asker: ModuleName,
        /// The module that was asked.
        peer: ModuleName,
        /// What.
        question: StateQuestion,
        /// The changes that the answer named.
        changes: Vec<Change>,
        /// The actuators that the peer declared faulty.
        actuator_faults: Vec<ActuatorFault>,
    },
    /// A fault was identified.
    Identified {
        /// The module.
        module: ModuleName,
        /// The possible kinds.
        identification: Box<IdentificationResult>,
    },
    /// A verdict changed.
    Transition {
        /// The module.
        module: ModuleName,
        /// The transition.
        transition: Box<Transition>,
    },
}

impl RigEvent {
    /// The change and its component, if it is one.
    #[must_use]
    pub fn change(&self) -> Option<(ComponentPath, &Change)> {
        let Self::Change { module, change } = self else { return None };
        let component = change.component.clone();
        Some((ComponentPath { module: module.clone(), component }, change))
    }

    /// The transition and its component, if it is one.
    #[must_use]
    pub fn transition(&self) -> Option<(ComponentPath, &Transition)> {
        let Self::Transition { module, transition } = self else { return None };
        let component = transition.component.clone();
        Some((ComponentPath { module: module.clone(), component }, transition))
    }

    /// The component declared faulty, if the event does so.
    #[must_use]
    pub fn diagnosed(&self) -> Option<Diagnosed> {
        let (component, transition) = self.transition()?;
        let (detection, decided) = (transition.detection, transition.decided);
        let is_latched = transition.verdict == Verdict::Latched;
        is_latched.then_some(Diagnosed { component, detection, decided })
    }
}

/// A component that was declared faulty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosed {
    /// The component.
    pub component: ComponentPath,
    /// When its divergence reached its threshold.
    pub detection: Step,
    /// The step as of which the verdict was found.
    pub decided: Step,
}

/// A diagnoser's setup is invalid.
#[derive(Debug, thiserror::Error)]
#[error("module `{module}`: {}", problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
pub struct GroupError {
    /// The module.
    pub module: ModuleName,
    /// The problems.
    pub problems: Vec<SetupError>,
}

/// Identifies a fault, perhaps without one of the kinds.
pub type Identify = fn(&Excerpt, Option<FaultKind>) -> IdentificationResult;

/// The diagnosers of several modules.
#[derive(Debug, Clone)]
pub struct DiagnoserGroup {
    setups: Vec<ModuleSetup>,
    diagnosers: Vec<Diagnoser>,
    occurrences: Vec<RigEvent>,
    actions: Vec<Action>,
    /// How many questions have been put.
    asked: u64,
    /// Those that are not answered yet, by token: who is to answer, the asker, the peer's name and the question.
    unanswered: BTreeMap<u64, (usize, usize, ModuleName, StateQuestion)>,
    /// What each diagnoser has stored.
    stores: Vec<StoredMemory>,
    identify: Option<Identify>,
    without: Option<FaultKind>,
}

impl DiagnoserGroup {
    /// A diagnoser for each setup. A peer that none of them is does not answer.
    ///
    /// # Errors
    /// A setup is invalid.
    pub fn new(setups: Vec<ModuleSetup>) -> Result<Self, GroupError> {
        let diagnosers = setups.iter().cloned().map(diagnoser);
        Ok(Self {
            diagnosers: diagnosers.collect::<Result<_, _>>()?,
            stores: setups.iter().map(|_| StoredMemory::default()).collect(),
            setups,
            occurrences: Vec::new(),
            actions: Vec::new(),
            asked: 0,
            unanswered: BTreeMap::new(),
            identify: None,
            without: None,
        })
    }

    /// The changes so far whose ratio is final, with their last steps as far as they are known.
    pub fn settled_changes(&self) -> impl Iterator<Item = (ComponentPath, &Change)> {
        self.stores.iter().zip(&self.setups).flat_map(|(store, setup)| {
            store.changes.iter().map(|change| {
                let component = change.component.clone();
                (ComponentPath { module: setup.module.clone(), component }, change)
            })
        })
    }

    /// The diagnosers, in the order of the setups.
    #[must_use]
    pub fn diagnosers(&self) -> &[Diagnoser] {
        &self.diagnosers
    }

    /// Returns all events so far, in order, and clears them.
    pub fn take_occurrences(&mut self) -> Vec<RigEvent> {
        std::mem::take(&mut self.occurrences)
    }

    /// Gives a diagnoser, by its index, its next sample; queries that follow are answered.
    pub fn take_sample(&mut self, place: usize, sample: &Measurements) {
        self.diagnosers[place].take_sample(sample, &mut self.actions);
        if !self.actions.is_empty() {
            self.carry_out(place);
        }
    }

    /// Gives each diagnoser that replaces a gage the latest forces of its peers.
    pub(crate) fn exchange_forces(&mut self) {
        let mut forces_n = Vec::new();
        for place in 0..self.diagnosers.len() {
            let Some(step) = self.diagnosers[place].last_step() else { continue };
            forces_n.clear();
            forces_n.extend_from_slice(self.diagnosers[place].forces_n());
            for (other, diagnoser) in self.diagnosers.iter_mut().enumerate() {
                if other != place && diagnoser.replaces_any() {
                    diagnoser.take_forces(&self.setups[place].module, step, &forces_n);
                }
            }
        }
    }

    /// Enables identification of faults: their kind and size, which takes milliseconds each time. `without` leaves a
    /// hypothesis out, to study faults of an unknown kind.
    pub fn identify(&mut self, without: Option<FaultKind>) {
        self.without = without;
        self.identify_by(identify);
    }

    /// Likewise with another function.
    pub fn identify_by(&mut self, identify: Identify) {
        self.identify = Some(identify);
    }

    /// Restarts a diagnoser, given by its index, with its stored state and these samples. What it was asked meanwhile
    /// stays unanswered; its peers ask again.
    pub(crate) fn restart<'a>(
        &mut self,
        place: usize,
        kept: impl Iterator<Item = &'a Measurements>,
    ) -> Result<(), GroupError> {
        let mut successor = diagnoser(self.setups[place].clone())?;
        successor.recall(self.stores[place].memory(&self.diagnosers[place]));
        self.diagnosers[place] = successor;
        let of_it = self.unanswered.extract_if(.., |_, (target, ..)| *target == place);
        for (_, (_, asker, peer, question)) in of_it.collect::<Vec<_>>() {
            self.pass(asker, Event::Unanswered { peer, question, failure: PeerFailure::Absent });
        }
        kept.for_each(|sample| self.take_sample(place, sample));
        let peer = self.setups[place].module.clone();
        for other in (0..self.diagnosers.len()).filter(|other| *other != place) {
            self.pass(other, Event::Returned { peer: peer.clone() });
        }
        Ok(())
    }

    fn pass(&mut self, place: usize, event: Event) {
        self.diagnosers[place].handle(event, &mut self.actions);
        self.carry_out(place);
    }

    /// Issues an operator's command to a diagnoser, given by its index. Returns why it was refused, if so.
    pub fn order(
        &mut self,
        place: usize,
        component: Component,
        order: GivenOrder,
    ) -> Option<OrderRefusal> {
        let event = Event::Ordered { token: OrderToken(0), component, order };
        self.diagnosers.get_mut(place)?.handle(event, &mut self.actions);
        let refusal = self.actions.iter().find_map(|action| match action {
            Action::OrderRefused { refusal, .. } => Some(refusal.clone()),
            _ => None,
        });
        self.carry_out(place);
        refusal
    }

    /// Carries out the actions of one diagnoser and their consequences.
    fn carry_out(&mut self, index: usize) {
        let mut pending: VecDeque<(usize, Action)> =
            self.actions.drain(..).map(|action| (index, action)).collect();
        while let Some((actor, action)) = pending.pop_front() {
            let Some((target, event)) = self.event_of(actor, action) else { continue };
            let mut actions = std::mem::take(&mut self.actions);
            if let Some(diagnoser) = self.diagnosers.get_mut(target) {
                diagnoser.handle(event, &mut actions);
            }
            pending.extend(actions.drain(..).map(|action| (target, action)));
            self.actions = actions;
        }
    }

    /// Converts an action to an event for another diagnoser; records what the study needs.
    fn event_of(&mut self, actor: usize, action: Action) -> Option<(usize, Event)> {
        let module = self.diagnosers.get(actor)?.module().clone();
        self.stores[actor].note(&action);
        match action {
            Action::Report { change, .. } => {
                self.occurrences.push(RigEvent::Change { module, change });
                None
            }
            Action::Publish(transition) => {
                let transition = Box::new(transition);
                self.occurrences.push(RigEvent::Transition { module, transition });
                None
            }
            Action::Identify(excerpt) => {
                if let Some(identify) = self.identify {
                    let identification = Box::new(identify(&excerpt, self.without));
                    self.occurrences.push(RigEvent::Identified { module, identification });
                }
                None
            }
            Action::Ask { peer, question } => {
                let Some(target) = self.diagnosers.iter().position(|d| *d.module() == peer) else {
                    let failure = PeerFailure::Absent;
                    return Some((actor, Event::Unanswered { peer, question, failure }));
                };
                let token = QuestionToken(self.asked);
                self.asked += 1;
                self.unanswered.insert(token.0, (target, actor, peer, question));
                Some((target, Event::Asked { token, question }))
            }
            Action::Answer { token, answer } => {
                let (_, asker, ..) = self.unanswered.remove(&token.0)?;
                if answer.question.window.is_none() {
                    self.occurrences.push(RigEvent::Question {
                        asker: self.diagnosers.get(asker)?.module().clone(),
                        peer: answer.module.clone(),
                        question: answer.question,
                        changes: answer.changes.clone(),
                        actuator_faults: answer.actuator_faults.clone(),
                    });
                }
                Some((asker, Event::Answered(answer)))
            }
            Action::Refuse { token, refusal } => {
                let (_, asker, peer, question) = self.unanswered.remove(&token.0)?;
                let failure = diagnosis::PeerFailure::Refused(refusal.to_string());
                Some((asker, Event::Unanswered { peer, question, failure }))
            }
            Action::Phase { .. }
            | Action::Freeze { .. }
            | Action::Settled { .. }
            | Action::Obeyed { .. }
            | Action::OrderRefused { .. }
            | Action::Rejected { .. }
            | Action::Gap { .. }
            | Action::Restarted { .. }
            | Action::SignalLost { .. }
            | Action::AnswerRejected { .. }
            | Action::WordBroken { .. }
            | Action::RunStarted(_)
            | Action::RunEnded => None,
        }
    }
}

/// The state of a diagnoser as its process would store it.
#[derive(Debug, Clone, Default)]
struct StoredMemory {
    run: Option<RunId>,
    /// The step since which every channel has been watched.
    watched_since: Option<Step>,
    /// Changes whose ratio is final.
    changes: Vec<Change>,
}

impl StoredMemory {
    /// Stores the effect of an action.
    fn note(&mut self, action: &Action) {
        match action {
            Action::RunEnded => *self = Self::default(),
            Action::RunStarted(run) => self.run = Some(*run),
            Action::Phase { in_service_since, .. } => self.watched_since = *in_service_since,
            Action::Settled { change, .. } => self.changes.push(change.clone()),
            _ => {}
        }
    }

    /// The memory for the successor of this diagnoser.
    fn memory(&self, diagnoser: &Diagnoser) -> Memory {
        let watched = self.watched_since.zip(diagnoser.last_step());
        let components = diagnoser.components().iter();
        Memory {
            sequence: diagnoser.next_sequence() - 1,
            latest: components.filter_map(|c| diagnoser.last_transition(c).cloned()).collect(),
            watch: self.run.map(|run| PastWatch { run, watched, changes: self.changes.clone() }),
        }
    }
}

/// A diagnoser before its first sample.
pub(crate) fn diagnoser(setup: ModuleSetup) -> Result<Diagnoser, GroupError> {
    let module = setup.module.clone();
    Diagnoser::new(setup).map_err(|problems| GroupError { module, problems })
}
