//! Merges published verdicts, kinds of faults, phases and presence into one feed without network access: the caller
//! passes messages, answers and the time, and receives news and the next question to ask.
//!
//! A subscriber misses messages when a link fails, a queue is full or the module is not connected yet. Modules
//! therefore number their transitions and report the count in their status; the feed fetches missing transitions from
//! the module's journal and requests the present state when a module appears.
//!
//! | file | job |
//! |---|---|
//! | `messages` | decodes messages |
//! | `module_feed` | orders and deduplicates what one module publishes, and finds gaps |
//! | `retries` | when to repeat a question |

mod messages;
mod module_feed;
mod retries;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::{FaultTransition, HistoryPage, ModuleName, StructureName};

use super::view::News;
use module_feed::ModuleFeed;

pub use messages::{Incoming, message, token};
pub use module_feed::ModuleQuery;

/// How long the connection has to be lost before that is reported: with several entry points another one takes over.
const LOST_AFTER: Duration = Duration::from_millis(300);
/// How long the first connection may take before its lack is reported.
const CONNECTED_WITHIN: Duration = Duration::from_secs(3);
/// How long a token has to be gone, and the connection to be there, before the process is reported to have left: when
/// the connection is lost all tokens disappear, and with a new one those of running processes appear again.
const LEFT_AFTER: Duration = Duration::from_millis(500);
/// How long after the connection tokens may arrive of processes that were there before.
const FOUND_WITHIN: Duration = Duration::from_secs(1);
/// Modules whose sequence numbers are tracked; messages of further modules are passed on as they arrive.
const MODULES: usize = 1024;

/// Structure and name of a module.
pub type ModuleKey = (StructureName, ModuleName);

/// The answer to a question.
#[derive(Debug)]
pub enum ModuleAnswer {
    /// The present states of one module, or of all.
    Present(Option<ModuleKey>, Vec<Incoming>),
    /// A page of a module's journal from a sequence number on, or the reason why it could not be read.
    Page(ModuleKey, u64, Result<HistoryPage, String>),
}

/// Hands out the messages of all modules, each once and in the order of its module.
#[derive(Debug, Default)]
pub struct EventFeed {
    modules: BTreeMap<ModuleKey, ModuleFeed>,
    /// The first query, for the present states of all modules, was answered.
    is_open: bool,
    connection: OwnConnection,
    /// Processes whose token disappeared, and when. They left only if the connection through which the token came is
    /// still there.
    gone: BTreeMap<(StructureName, String), Instant>,
}

/// The observer's own connection.
#[derive(Debug, Default)]
struct OwnConnection {
    /// Since when it has been as it is; `None` before the first look.
    since: Option<Instant>,
    is_there: bool,
    /// Whether its loss was reported.
    is_lost: bool,
    /// Whether it has been there before.
    was_there: bool,
}

impl OwnConnection {
    /// Whether what is heard now may have been there before the connection.
    fn is_new(&self, now: Instant) -> bool {
        let since = self.since.filter(|_| self.is_there);
        since.is_none_or(|since| now.saturating_duration_since(since) < FOUND_WITHIN)
    }
}

impl EventFeed {
    /// Handles a published message, or a token that appeared or disappeared.
    pub fn published(&mut self, incoming: Incoming, now: Instant) -> Vec<News> {
        match incoming {
            Incoming::Transition(transition) => self.transition(*transition),
            Incoming::Status(status) => {
                let key = (status.structure.clone(), status.module.clone());
                self.module(&key).map_or_else(Vec::new, |module| module.status(&status, now))
            }
            Incoming::Token(key, there) => {
                self.presence(&key, there, now);
                let (structure, module) = key;
                self.token(structure, module.to_string(), there, now)
            }
            Incoming::Other(News::Presence { structure, who, there, .. }) => {
                self.token(structure, who, there, now)
            }
            other => self.other(other, false).into_iter().collect(),
        }
    }

    /// Handles the answer to a question.
    pub fn answered(&mut self, answer: ModuleAnswer, now: Instant) -> Vec<News> {
        match answer {
            ModuleAnswer::Present(key, replies) => self.replies(key.as_ref(), replies, now),
            ModuleAnswer::Page(key, since, page) => {
                self.module(&key).map_or_else(Vec::new, |module| module.page(since, page, now))
            }
        }
    }

    /// Takes note of whether the observer is connected to any process; to be called every tenth of a second or so.
    /// Reports a loss, its end, and who has left.
    pub fn connection(&mut self, is_there: bool, now: Instant) -> Vec<News> {
        let connection = &mut self.connection;
        if connection.since.is_none() || connection.is_there != is_there {
            (connection.since, connection.is_there) = (Some(now), is_there);
        }
        let lasts = now.saturating_duration_since(connection.since.unwrap_or(now));
        let patience = if connection.was_there { LOST_AFTER } else { CONNECTED_WITHIN };
        connection.was_there |= is_there;
        if !is_there {
            let is_news = lasts >= patience && !connection.is_lost;
            connection.is_lost |= is_news;
            return is_news.then_some(News::Connection { connected: false }).into_iter().collect();
        }
        let is_back = std::mem::take(&mut connection.is_lost);
        let mut news: Vec<_> =
            is_back.then_some(News::Connection { connected: true }).into_iter().collect();
        if lasts >= LEFT_AFTER {
            let has_left = |_: &(StructureName, String), gone: &mut Instant| {
                now.saturating_duration_since(*gone) >= LEFT_AFTER
            };
            let left = self.gone.extract_if(.., has_left);
            news.extend(left.map(|((structure, who), _)| News::Presence {
                structure,
                who,
                there: false,
                at_start: false,
            }));
        }
        news
    }

    /// Reports a process that appeared. One that disappeared is reported when it is known that it left.
    fn token(
        &mut self,
        structure: StructureName,
        who: String,
        there: bool,
        now: Instant,
    ) -> Vec<News> {
        if !there {
            self.gone.insert((structure, who), now);
            return Vec::new();
        }
        let is_back = self.gone.remove(&(structure.clone(), who.clone())).is_some();
        let at_start = !self.is_open || self.connection.is_new(now);
        let presence = News::Presence { structure, who, there, at_start };
        (!is_back).then_some(presence).into_iter().collect()
    }

    fn transition(&mut self, transition: FaultTransition) -> Vec<News> {
        match self.module(&key_of(&transition)) {
            Some(module) => module.published(transition),
            None => vec![News::Fault(Box::new(transition))],
        }
    }

    fn presence(&mut self, key: &ModuleKey, there: bool, now: Instant) {
        match self.known_or_new(key) {
            Some(module) if there => module.appear(),
            Some(module) => module.disappear(now),
            None => {}
        }
    }

    /// Handles an identification, a phase, or a message that has no order.
    fn other(&mut self, incoming: Incoming, is_answer: bool) -> Option<News> {
        match incoming {
            Incoming::Identification(found) => {
                match self.module(&(found.structure.clone(), found.module.clone())) {
                    Some(module) => module.identification(*found, is_answer),
                    None => Some(News::Identification(found)),
                }
            }
            Incoming::Phase(change) => {
                match self.module(&(change.structure.clone(), change.module.clone())) {
                    Some(module) => module.phase(change, is_answer),
                    None => Some(News::Phase(change)),
                }
            }
            Incoming::Other(news) => Some(news),
            Incoming::Transition(_) | Incoming::Status(_) | Incoming::Token(..) => None,
        }
    }

    /// Handles the present states of one module or of all. States go first, because an identification belongs to a
    /// fault.
    fn replies(
        &mut self,
        key: Option<&ModuleKey>,
        replies: Vec<Incoming>,
        now: Instant,
    ) -> Vec<News> {
        let (mut states, mut others) = (Vec::new(), Vec::new());
        for reply in replies {
            match reply {
                Incoming::Transition(state) => states.push(*state),
                other => others.push(other),
            }
        }
        let mut news = match key {
            None => self.open(states, now),
            Some(key) => {
                states.retain(|state| key_of(state) == *key);
                self.present(key, states, now)
            }
        };
        news.extend(others.into_iter().filter_map(|other| self.other(other, true)));
        news
    }

    /// Handles the answers to the first query, which goes to all modules. Modules that did not answer are queried one
    /// by one.
    fn open(&mut self, states: Vec<FaultTransition>, now: Instant) -> Vec<News> {
        self.is_open = true;
        let mut of_module: BTreeMap<ModuleKey, Vec<FaultTransition>> = BTreeMap::new();
        for state in states {
            of_module.entry(key_of(&state)).or_default().push(state);
        }
        of_module.into_iter().flat_map(|(key, states)| self.present(&key, states, now)).collect()
    }

    /// Handles the present states of a module; an empty list if it did not answer.
    fn present(
        &mut self,
        key: &ModuleKey,
        states: Vec<FaultTransition>,
        now: Instant,
    ) -> Vec<News> {
        self.module(key).map_or_else(Vec::new, |module| module.present(states, now))
    }

    /// Returns a question that is due, if any, and records it as asked.
    pub fn question(&mut self, now: Instant) -> Option<(ModuleKey, ModuleQuery)> {
        if !self.is_open {
            return None;
        }
        let due = |(key, module): (&ModuleKey, &mut ModuleFeed)| {
            Some((key.clone(), module.question(now)?))
        };
        self.modules.iter_mut().find_map(due)
    }

    /// The feed of a module's message. Beyond [`MODULES`], it takes the place of one of which only a token was seen.
    fn module(&mut self, key: &ModuleKey) -> Option<&mut ModuleFeed> {
        if self.modules.len() >= MODULES && !self.modules.contains_key(key) {
            let only_seen = self.modules.iter().find(|(_, module)| module.is_only_seen());
            if let Some(key) = only_seen.map(|(key, _)| key.clone()) {
                self.modules.remove(&key);
            }
        }
        self.known_or_new(key)
    }

    fn known_or_new(&mut self, key: &ModuleKey) -> Option<&mut ModuleFeed> {
        if !self.modules.contains_key(key) {
            if self.modules.len() >= MODULES {
                return None;
            }
            self.modules.insert(key.clone(), ModuleFeed::new(key));
        }
        self.modules.get_mut(key)
    }
}

fn key_of(transition: &FaultTransition) -> ModuleKey {
    (transition.structure.clone(), transition.module.clone())
}
