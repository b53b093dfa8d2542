//! What outlives the diagnoser's process: its journal, and the file that records how far it had watched.

use diagnosis::{Action, Change, Diagnoser, Memory, PastWatch};
use vocabulary::RunId;

/// The latest steps count as watched only when their changes are in the journal.
const TIE: u64 = 3;

/// A journal.
#[derive(Debug, Default)]
pub struct Journal {
    memory: Memory,
    changes: Vec<(RunId, Change)>,
}

impl Journal {
    /// Takes note of an action.
    pub fn note(&mut self, action: &Action) {
        match action {
            Action::Publish(transition) => {
                self.memory.sequence = transition.sequence;
                self.memory.latest.retain(|known| known.component != transition.component);
                self.memory.latest.push(transition.clone());
            }
            Action::RunEnded => {
                self.memory.latest.iter_mut().for_each(|latest| latest.run_ended = true);
                self.changes.clear();
            }
            Action::Settled { run, change } => self.changes.push((*run, change.clone())),
            _ => {}
        }
    }

    /// Takes note of how far the diagnoser has watched.
    pub fn watch(&mut self, diagnoser: &Diagnoser) {
        let (Some(run), Some(last)) = (diagnoser.run(), diagnoser.last_step()) else { return };
        let until = last.minus(TIE + 1);
        let since = diagnoser.in_service_since().filter(|since| *since <= until);
        let watched = since.map(|since| (since, until));
        if watched.is_none() && self.memory.watch.as_ref().is_some_and(|known| known.run == run) {
            return;
        }
        self.memory.watch = Some(PastWatch { run, watched, changes: Vec::new() });
    }

    /// What a new process recalls.
    pub fn recollection(&self) -> Memory {
        let mut memory = self.memory.clone();
        if let Some(watch) = &mut memory.watch {
            let own = self.changes.iter().filter(|(run, _)| *run == watch.run);
            watch.changes = own.map(|(_, change)| change.clone()).collect();
            watch.changes.sort_by_key(|change| change.step);
        }
        memory
    }
}
