//! Compares a module's history, queried over the network, with collected transitions and obeyed commands.

use std::collections::BTreeMap;
use std::time::Duration;

use ::observer::{ModuleHistory, QueryError};
use session::client::history;
use vocabulary::{ComponentPath, FaultTransition, ModuleName};

use super::collection::{Collected, same};
use super::operator::{Books, Done};
use crate::in_time;
use crate::observer::Observer;

/// Timeout for a page of history.
const TIMEOUT: Duration = Duration::from_secs(2);
/// Retry interval after an unanswered query.
const PAUSE: Duration = Duration::from_millis(20);

/// A module's history, and what is wrong with it.
#[derive(Debug)]
pub struct Audit {
    /// The history.
    pub history: ModuleHistory,
    /// Violations.
    pub problems: Vec<String>,
}

impl Audit {
    /// Reads a module's history. What was collected and obeyed must have been so before this is called.
    pub async fn of(
        observer: &Observer,
        module: &ModuleName,
        collected: &Collected,
        books: &Books,
    ) -> Self {
        let history = in_time("a whole history", read(observer, module)).await;
        let mut problems = Vec::new();
        check_numbers(&history, &mut problems);
        let known: BTreeMap<u64, &FaultTransition> =
            history.transitions.iter().map(|known| (known.sequence, known)).collect();
        let published = collected.transitions.values().filter(|seen| seen.module == *module);
        for seen in published {
            match known.get(&seen.sequence) {
                Some(known) if same(known, seen) => {}
                Some(known) => problems.push(format!("published {seen:?}, history has {known:?}")),
                None => problems.push(format!("published, and not in the history: {seen:?}")),
            }
        }
        for done in books.done.iter().filter(|done| done.module == *module) {
            if !known.get(&done.obeyed.sequence).is_some_and(|known| tells_of(known, done)) {
                problems.push(format!("obeyed, and not in the history: {done:?}"));
            }
        }
        Self { history, problems }
    }

    /// The latest transition of each component.
    #[must_use]
    pub fn latest(&self) -> BTreeMap<ComponentPath, FaultTransition> {
        let transitions = self.history.transitions.iter().cloned();
        transitions.map(|transition| (transition.component.clone(), transition)).collect()
    }
}

/// A process that was just killed still appears connected and does not reply, so the query is retried.
async fn read(observer: &Observer, module: &ModuleName) -> ModuleHistory {
    loop {
        let read = history(&observer.session, &observer.structure, module, 1, TIMEOUT).await;
        match read.broken_off {
            Some(QueryError::Unanswered(_)) => tokio::time::sleep(PAUSE).await,
            _ => return read,
        }
    }
}

/// They begin with 1 and go on without a gap to the next one that will be.
fn check_numbers(history: &ModuleHistory, problems: &mut Vec<String>) {
    if let Some(error) = &history.broken_off {
        problems.push(format!("the history breaks off: {error}"));
    }
    let numbers = history.transitions.iter().map(|transition| transition.sequence);
    if !numbers.eq(1..history.next_sequence.unwrap_or(1)) || !history.gaps().is_empty() {
        let gaps = history.gaps();
        problems.push(format!("the history has gaps: {gaps:?}, from {:?}", history.first_sequence));
    }
}

/// Is this the transition that a command caused?
fn tells_of(transition: &FaultTransition, done: &Done) -> bool {
    let Done { kind, order, obeyed, .. } = done;
    let given = order.clone().given(*kind, 0);
    Some(&transition.component.component) == obeyed.component.as_ref()
        && transition.state() == obeyed.state
        && transition.order == Some(given)
}
