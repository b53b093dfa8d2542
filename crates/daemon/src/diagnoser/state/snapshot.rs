//! What a new file of the journal begins with: all of the present state, and the latest changes.

use std::collections::VecDeque;

use vocabulary::{ComponentPath, FaultTransition, Identification, ModuleName};

use super::record::Record;

/// Changes that it holds.
const CHANGES: usize = 512;

/// The present state, as it stands in the journal's records.
#[derive(Debug, Default)]
pub(crate) struct Snapshot {
    /// The latest start, for what sequence numbers count in.
    start: Option<String>,
    /// The latest end of a run, if there was one: it holds of what other files say, too.
    run_ended: Option<String>,
    /// Of each component the latest transition.
    present: Vec<Latest>,
    /// Of each component that is faulty, the latest word on what its fault is.
    identified: Vec<Latest>,
    changes: VecDeque<String>,
}

/// One of the latest records.
#[derive(Debug)]
struct Latest {
    /// The module that wrote it. The recollection accepts its own module only.
    module: ModuleName,
    component: ComponentPath,
    sequence: u64,
    text: String,
}

impl Snapshot {
    /// Takes note of a record, whose text is given.
    pub(crate) fn note(&mut self, record: Record, text: String) {
        match record {
            Record::Transition(transition) => self.note_state(*transition, text),
            Record::Identification(found) => self.note_kind(*found, text),
            Record::Change { .. } => {
                if self.changes.len() == CHANGES {
                    self.changes.pop_front();
                }
                self.changes.push_back(text);
            }
            Record::RunEnded => {
                self.changes.clear();
                self.present.iter_mut().for_each(Latest::end_run);
                self.run_ended = Some(text);
            }
            Record::Start { .. } => self.start = Some(text),
        }
    }

    /// Takes note of records as text; those that are none are passed over.
    pub(crate) fn note_texts(&mut self, texts: impl IntoIterator<Item = String>) {
        for text in texts {
            if let Some(record) = Record::from_text(&text) {
                self.note(record, text);
            }
        }
    }

    /// The records, in an order in which they can be read: what a fault is comes after the fault.
    pub(crate) fn texts(&self) -> impl Iterator<Item = &str> {
        let states = self.present.iter().chain(&self.identified);
        let states = states.map(|latest| latest.text.as_str());
        let first = self.start.iter().chain(&self.run_ended).chain(&self.changes);
        first.map(String::as_str).chain(states)
    }

    /// Whether there is nothing in it.
    pub(crate) fn is_empty(&self) -> bool {
        self.texts().next().is_none()
    }

    /// The number decides which transition is the latest, as it does in the recollection.
    fn note_state(&mut self, transition: FaultTransition, text: String) {
        let FaultTransition { module, component, sequence, verdict, .. } = transition;
        let before = |known: &Latest| known.is_of(&module, &component) && known.sequence < sequence;
        if !verdict.is_latched() {
            // What it says of a fault before this is over.
            self.identified.retain(|known| !before(known));
        }
        Latest { module, component, sequence, text }.take_place_in(&mut self.present);
    }

    fn note_kind(&mut self, found: Identification, text: String) {
        let Identification { module, component, sequence, .. } = found;
        Latest { module, component, sequence, text }.take_place_in(&mut self.identified);
    }
}

impl Latest {
    fn is_of(&self, module: &ModuleName, component: &ComponentPath) -> bool {
        (&self.module, &self.component) == (module, component)
    }

    fn end_run(&mut self) {
        if let Some(Record::Transition(mut transition)) = Record::from_text(&self.text) {
            transition.run_ended = true;
            if let Ok(text) = Record::Transition(transition).to_text() {
                self.text = text;
            }
        }
    }

    /// Takes the place of what is known of the component, unless that is of a later transition.
    fn take_place_in(self, known: &mut Vec<Latest>) {
        let is_same = |one: &Latest| one.is_of(&self.module, &self.component);
        let place = known.iter().position(is_same);
        if let Some(place) = place {
            if known[place].sequence > self.sequence {
                return;
            }
            known.remove(place);
        }
        known.push(self);
    }
}
