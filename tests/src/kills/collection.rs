//! Every transition that a subscriber has ever got.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::task::JoinHandle;
use truss::ids::ModuleName;
use wire::FaultTransition;

use crate::observer::Faults;

/// A transition by its module and its number there.
pub type Numbered = BTreeMap<(ModuleName, u64), FaultTransition>;

/// What a subscriber has got so far.
#[derive(Debug, Clone, Default)]
pub struct Collected {
    /// Each transition once.
    pub transitions: Numbered,
    /// How many messages that were.
    pub messages: usize,
    /// Numbers that were given twice.
    pub contradictions: Vec<String>,
}

/// Collects as long as it lives.
pub struct Collection {
    collected: Arc<Mutex<Collected>>,
    task: JoinHandle<()>,
}

impl Collection {
    /// Collects whatever comes.
    #[must_use]
    pub fn of(mut faults: Faults) -> Self {
        let collected = Arc::new(Mutex::new(Collected::default()));
        let into = Arc::clone(&collected);
        let task = tokio::spawn(async move {
            while let Some((_, transition)) = faults.recv().await {
                lock(&into).take(transition);
            }
        });
        Self { collected, task }
    }

    /// What has come so far.
    #[must_use]
    pub fn so_far(&self) -> Collected {
        lock(&self.collected).clone()
    }
}

impl Drop for Collection {
    fn drop(&mut self) {
        self.task.abort();
    }
}

impl Collected {
    fn take(&mut self, transition: FaultTransition) {
        self.messages += 1;
        let place = (transition.module.clone(), transition.sequence);
        match self.transitions.get(&place) {
            Some(known) if same(known, &transition) => {}
            Some(known) => {
                self.contradictions.push(format!("published {known:?} and then {transition:?}"));
            }
            None => {
                self.transitions.insert(place, transition);
            }
        }
    }
}

/// Are these the same but for when they were published, and whether the disk had it by then?
#[must_use]
pub fn same(one: &FaultTransition, other: &FaultTransition) -> bool {
    let timeless = |transition: &FaultTransition| FaultTransition {
        time_unix_ns: 0,
        durable: true,
        ..transition.clone()
    };
    timeless(one) == timeless(other)
}

fn lock(collected: &Mutex<Collected>) -> MutexGuard<'_, Collected> {
    collected.lock().unwrap_or_else(PoisonError::into_inner)
}
