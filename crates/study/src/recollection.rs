//! What a diagnoser leaves behind for the one that is started after it.

use diagnosis::{Action, Change, Diagnoser, Memory, PastWatch, Phase};
use vocabulary::{RunId, Step};

/// What a diagnoser has stored, as a shell around it would.
#[derive(Debug, Default)]
pub(crate) struct Store {
    run: Option<RunId>,
    /// Since when every channel has been watched.
    watched_since: Option<Step>,
    /// Changes whose ratio is final.
    changes: Vec<Change>,
}

impl Store {
    /// Takes what an action says.
    pub(crate) fn note(&mut self, action: &Action) {
        match action {
            Action::RunEnded => *self = Self::default(),
            Action::RunStarted(run) => self.run = Some(*run),
            Action::Phase(Phase::InService { since }) => self.watched_since = Some(*since),
            Action::Phase(_) => self.watched_since = None,
            Action::Settled { change, .. } => self.changes.push(change.clone()),
            _ => {}
        }
    }

    /// What the successor of this diagnoser takes up.
    pub(crate) fn memory(&self, diagnoser: &Diagnoser) -> Memory {
        let watched = self.watched_since.zip(diagnoser.last_step());
        let components = diagnoser.components().iter();
        Memory {
            sequence: diagnoser.next_sequence() - 1,
            latest: components.filter_map(|c| diagnoser.last_transition(c).cloned()).collect(),
            watch: self.run.map(|run| PastWatch { run, watched, changes: self.changes.clone() }),
        }
    }
}
