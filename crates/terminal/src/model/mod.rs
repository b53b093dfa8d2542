//! What is shown and what is typed: a plain value. Events and the time go in, effects come out.
//!
//! | file | what |
//! |---|---|
//! | `subject` | what a row is about |
//! | `rows` | which rows there are, the most urgent first |
//! | `cursor` | which row is selected |
//! | `filter` | what rows are looked for |
//! | `close_up` | one component, closely |
//! | `journal` | its history |
//! | `dialog` | an order while it is being worded |
//! | `notice` | what became of it |
//! | `key` | keys |
//! | `exchange` | what is to be done outside, and what comes of it |
//! | `keys` | what each key does |

pub(crate) mod close_up;
mod cursor;
pub(crate) mod dialog;
pub(crate) mod exchange;
mod filter;
pub(crate) mod journal;
mod key;
mod keys;
mod notice;
mod rows;
mod subject;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use observer::{NetworkState, Scene, StateRow};

use crate::settings::Settings;
use close_up::{CloseUp, Had};
use cursor::Cursor;
use dialog::Dialog;
use exchange::{Answer, Effect};
use journal::Journal;

pub(crate) use filter::Filter;
pub(crate) use key::Key;
pub(crate) use notice::Notice;
pub(crate) use rows::{Row, listed, modules};
pub(crate) use subject::{Subject, Whose};

/// Which list the keys move in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pane {
    Modules,
    Faults,
    Events,
}

/// Everything that the screen is drawn from.
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) settings: Settings,
    scene: Arc<Scene>,
    frozen: Option<Arc<Scene>>,
    now_unix_ns: u64,
    pub(crate) pane: Pane,
    module_cursor: Cursor<Whose>,
    fault_cursor: Cursor<Row>,
    /// Events that are scrolled over, from the latest.
    pub(crate) events_back: usize,
    pub(crate) filter: Filter,
    /// Whether the filter is being typed.
    pub(crate) types_filter: bool,
    /// The module whose components are listed.
    pub(crate) scope: Option<Whose>,
    pub(crate) close_up: Option<Box<CloseUp>>,
    pub(crate) journal: Option<Box<Journal>>,
    pub(crate) dialog: Option<Box<Dialog>>,
    pub(crate) notice: Option<Notice>,
    pub(crate) helps: bool,
}

impl Model {
    pub(crate) fn new(settings: Settings, now_unix_ns: u64) -> Self {
        Self {
            settings,
            scene: Arc::default(),
            frozen: None,
            now_unix_ns,
            pane: Pane::Faults,
            module_cursor: Cursor::default(),
            fault_cursor: Cursor::default(),
            events_back: 0,
            filter: Filter::default(),
            types_filter: false,
            scope: None,
            close_up: None,
            journal: None,
            dialog: None,
            notice: None,
            helps: false,
        }
    }

    /// What is shown: the latest, unless it is frozen.
    pub(crate) fn shown(&self) -> &Scene {
        self.frozen.as_deref().unwrap_or(&self.scene)
    }

    /// When what is shown was the case, as far as ages are concerned \[ns since 1970\].
    pub(crate) fn shown_unix_ns(&self) -> u64 {
        self.frozen.as_ref().map_or(self.now_unix_ns, |scene| scene.time_unix_ns)
    }

    /// For how long the screen has been frozen \[ns\], if it is.
    pub(crate) fn frozen_for_ns(&self) -> Option<u64> {
        let frozen = self.frozen.as_ref()?;
        Some(self.now_unix_ns.saturating_sub(frozen.time_unix_ns))
    }

    /// How old the latest picture is \[ns\].
    pub(crate) fn picture_age_ns(&self) -> u64 {
        self.now_unix_ns.saturating_sub(self.scene.time_unix_ns)
    }

    /// The rows of the list of alarms.
    pub(crate) fn listed(&self) -> Vec<StateRow> {
        listed(self.shown(), &self.filter, self.scope.as_ref())
    }

    pub(crate) fn rows(&self) -> Vec<Row> {
        self.listed().iter().map(Row::of).collect()
    }

    pub(crate) fn modules(&self) -> Vec<Whose> {
        modules(self.shown())
    }

    pub(crate) fn fault_place(&self, rows: &[Row]) -> usize {
        self.fault_cursor.place(rows)
    }

    pub(crate) fn module_place(&self, rows: &[Whose]) -> usize {
        self.module_cursor.place(rows)
    }

    /// The time goes on.
    pub(crate) fn on_tick(&mut self, now_unix_ns: u64) -> Vec<Effect> {
        self.now_unix_ns = now_unix_ns;
        self.questions()
    }

    /// There is something new to see.
    pub(crate) fn on_scene(&mut self, scene: Arc<Scene>, now_unix_ns: u64) -> Vec<Effect> {
        let is_open = |scene: &Scene| scene.network == NetworkState::Open;
        let is_opened = is_open(&scene) && !is_open(&self.scene);
        self.scene = scene;
        // What was listened to over a former session has ended with it.
        let again = self.close_up.as_ref().filter(|_| is_opened).map(|seen| seen.module());
        let mut effects: Vec<Effect> =
            again.map(|module| Effect::Listen(Some(module))).into_iter().collect();
        effects.extend(self.on_tick(now_unix_ns));
        effects
    }

    /// Something that was asked for has come. What nobody looks at any more is passed over.
    pub(crate) fn on_answer(&mut self, answer: Answer) {
        match answer {
            Answer::Order(given, outcome) => self.notice = Some(Notice::ended(&given, &outcome)),
            Answer::Frame(of, frame) => {
                if let Some(seen) = self.close_up_of(&of) {
                    seen.frame = frame.map_or_else(Had::Missing, Had::Here);
                }
            }
            Answer::Identification(of, found) => {
                if let Some(seen) = self.close_up_of(&of) {
                    seen.identification = found.map_or_else(Had::Missing, Had::Here);
                }
            }
            Answer::History(of, history) => {
                if let Some(journal) = self.journal_of(&of) {
                    journal.take(&history);
                }
            }
            Answer::Divergences(message) => {
                if self.frozen.is_none()
                    && let Some(seen) = &mut self.close_up
                {
                    seen.listen(&message);
                }
            }
        }
    }

    fn close_up_of(&mut self, subject: &Subject) -> Option<&mut CloseUp> {
        self.close_up.as_deref_mut().filter(|seen| seen.subject == *subject)
    }

    fn journal_of(&mut self, subject: &Subject) -> Option<&mut Journal> {
        self.journal.as_deref_mut().filter(|journal| journal.subject == *subject)
    }

    fn questions(&mut self) -> Vec<Effect> {
        let scene = self.scene.clone();
        let Some(seen) = &mut self.close_up else { return Vec::new() };
        let present = seen.subject.find(&scene);
        present.map_or_else(Vec::new, |present| seen.questions(present, self.now_unix_ns))
    }
}
