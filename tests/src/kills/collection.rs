//! Every transition that a subscriber has received.

use std::collections::BTreeMap;

use ::observer::{ModuleHistory, News};
use tokio::sync::watch::Sender;
use vocabulary::{FaultTransition, ModuleName};

use crate::in_time;
use crate::noted::Noted;
use crate::observer::{Hearing, Observer};

/// A transition by its module and its number there.
pub type Numbered = BTreeMap<(ModuleName, u64), FaultTransition>;

/// What a subscriber has received so far.
#[derive(Debug, Clone, Default)]
pub struct Collected {
    /// Each transition once.
    pub transitions: Numbered,
    /// Number of messages.
    pub messages: usize,
    /// Numbers that were given twice, and what was reported as missed.
    pub contradictions: Vec<String>,
}

/// Collects as long as it lives.
pub struct Collection(Noted<Collected, Hearing>);

impl Collection {
    /// Starts collecting.
    pub async fn of(observer: &Observer) -> Self {
        let collected = Sender::new(Collected::default());
        let into = collected.clone();
        let take = move |news| into.send_modify(|collected| collected.hear(news));
        Self(Noted::by(collected, observer.hear(take).await))
    }

    /// What has come so far.
    #[must_use]
    pub fn so_far(&self) -> Collected {
        self.0.so_far().clone()
    }

    /// Waits until every transition of this history has come.
    pub async fn has_all(&self, history: &ModuleHistory) {
        let is_there = |collected: &Collected| {
            let place = |known: &FaultTransition| (history.module.clone(), known.sequence);
            let mut known = history.transitions.iter().map(place);
            known.all(|place| collected.transitions.contains_key(&place)).then_some(())
        };
        in_time(&format!("all transitions of {}", history.module), self.0.first(is_there)).await;
    }
}

impl Collected {
    fn hear(&mut self, news: News) {
        match news {
            News::Fault(transition) | News::Present(transition) => self.take(*transition),
            News::Missed { .. } | News::Lost { .. } => {
                self.contradictions.push(format!("{news:?}"));
            }
            _ => {}
        }
    }

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
