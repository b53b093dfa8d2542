//! The state of the view as a plain value. Events and the time go in, effects come out.
//!
//! | file | what |
//! |---|---|
//! | `rows` | the rows of the lists, most urgent first |
//! | `cursor` | the selected row |
//! | `close_up` | the close-up of one component |
//! | `history` | its history |
//! | `dialog` | the dialog for an order |
//! | `keys` | the effect of each key |

pub(crate) mod close_up;
mod cursor;
pub(crate) mod dialog;
pub(crate) mod history;
mod keys;
mod rows;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use observer::{
    ComponentId, ModuleHistory, ModuleId, ModuleView, NetworkState, OrderOutcome, OrderRequest,
    RowId, Scene, StateRow,
};
use vocabulary::words::Tone;
use vocabulary::{Divergences, FaultTransition, FreezeFrame, Identification};

use crate::ViewSettings;
use close_up::{CloseUp, Fetched};
use cursor::RowCursor;
use dialog::Dialog;
use history::ComponentHistory;

use rows::listed;

/// An effect to be carried out outside the model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ModelEffect {
    /// Send an order.
    Order(OrderRequest),
    /// Request the freeze frame of a component's present fault.
    Frame(Box<FaultTransition>),
    /// Request the kind of a component's fault.
    Identification(ComponentId),
    /// Request the journal of a component's module.
    History(ComponentId),
    /// Subscribe to the divergences of this module only.
    Listen(Option<ModuleId>),
    /// Restore the terminal until the process is continued.
    Suspend,
    /// Quit.
    Quit,
}

/// The result of an effect. Reasons may be texts from other processes.
#[derive(Debug, Clone)]
pub(crate) enum TaskResult {
    Order(OrderRequest, OrderOutcome),
    Frame(ComponentId, Result<Box<FreezeFrame>, String>),
    Identification(ComponentId, Result<Option<Box<Identification>>, String>),
    History(ComponentId, Box<ModuleHistory>),
    Divergences(Box<Divergences>),
}

/// The outcome of the latest input, on one line, and its severity.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Notice {
    pub(crate) tone: Tone,
    pub(crate) text: String,
}

impl Notice {
    pub(crate) fn refusal(reason: impl Into<String>) -> Self {
        Self { tone: Tone::Doubt, text: reason.into() }
    }

    /// The order was sent.
    pub(crate) fn sent(request: &OrderRequest) -> Self {
        let (kind, subject) = (request.kind.as_str(), request.subject());
        Self { tone: Tone::Explained, text: format!("sent: {kind} {subject}; no answer yet") }
    }

    /// The outcome of the order.
    pub(crate) fn ended(request: &OrderRequest, outcome: &OrderOutcome) -> Self {
        let text = outcome.words(request.kind, &request.subject());
        Self { tone: outcome.tone(), text }
    }
}

/// The list that the keys move in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Pane {
    Modules,
    Faults,
    Events,
}

/// All data that the screen is drawn from.
#[derive(Debug)]
pub(crate) struct Model {
    pub(crate) settings: ViewSettings,
    scene: Arc<Scene>,
    frozen: Option<Arc<Scene>>,
    now_unix_ns: u64,
    pub(crate) pane: Pane,
    module_cursor: RowCursor<ModuleId>,
    fault_cursor: RowCursor<RowId>,
    /// Number of events scrolled past, from the latest.
    pub(crate) events_back: usize,
    /// The words that filter rows.
    pub(crate) filter: String,
    /// Whether the filter is being typed.
    pub(crate) types_filter: bool,
    /// The module whose components are listed.
    pub(crate) scope: Option<ModuleId>,
    pub(crate) close_up: Option<Box<CloseUp>>,
    pub(crate) journal: Option<Box<ComponentHistory>>,
    pub(crate) dialog: Option<Box<Dialog>>,
    pub(crate) notice: Option<Notice>,
    pub(crate) helps: bool,
}

impl Model {
    pub(crate) fn new(settings: ViewSettings, now_unix_ns: u64) -> Self {
        Self {
            settings,
            scene: Arc::default(),
            frozen: None,
            now_unix_ns,
            pane: Pane::Faults,
            module_cursor: RowCursor::default(),
            fault_cursor: RowCursor::default(),
            events_back: 0,
            filter: String::new(),
            types_filter: false,
            scope: None,
            close_up: None,
            journal: None,
            dialog: None,
            notice: None,
            helps: false,
        }
    }

    /// The scene on the screen: the latest, unless frozen.
    pub(crate) fn shown(&self) -> &Scene {
        self.frozen.as_deref().unwrap_or(&self.scene)
    }

    /// The time to which ages on the screen refer \[ns since 1970\].
    pub(crate) fn shown_unix_ns(&self) -> u64 {
        self.frozen.as_ref().map_or(self.now_unix_ns, |scene| scene.time_unix_ns)
    }

    /// For how long the screen has been frozen \[ns\], if it is.
    pub(crate) fn frozen_for_ns(&self) -> Option<u64> {
        let frozen = self.frozen.as_ref()?;
        Some(self.now_unix_ns.saturating_sub(frozen.time_unix_ns))
    }

    /// The age of the latest scene \[ns\].
    pub(crate) fn picture_age_ns(&self) -> u64 {
        self.now_unix_ns.saturating_sub(self.scene.time_unix_ns)
    }

    /// The rows of the list of alarms.
    pub(crate) fn listed(&self) -> Vec<StateRow> {
        listed(self.shown(), &self.filter, self.scope.as_ref())
    }

    pub(crate) fn rows(&self) -> Vec<RowId> {
        self.listed().iter().map(StateRow::id).collect()
    }

    pub(crate) fn modules(&self) -> Vec<ModuleId> {
        self.shown().modules.iter().map(ModuleView::id).collect()
    }

    pub(crate) fn fault_place(&self, rows: &[RowId]) -> usize {
        self.fault_cursor.place(rows)
    }

    pub(crate) fn module_place(&self, rows: &[ModuleId]) -> usize {
        self.module_cursor.place(rows)
    }

    /// Handles the passage of time.
    pub(crate) fn on_tick(&mut self, now_unix_ns: u64) -> Vec<ModelEffect> {
        self.now_unix_ns = now_unix_ns;
        self.questions()
    }

    /// Handles a new scene.
    pub(crate) fn on_scene(&mut self, scene: Arc<Scene>, now_unix_ns: u64) -> Vec<ModelEffect> {
        let is_open = |scene: &Scene| scene.network == NetworkState::Open;
        let is_opened = is_open(&scene) && !is_open(&self.scene);
        self.scene = scene;
        // A subscription made over a former session ended with it.
        let again = self.close_up.as_ref().filter(|_| is_opened).map(|seen| seen.subject.module());
        let mut effects: Vec<ModelEffect> =
            again.map(|module| ModelEffect::Listen(Some(module))).into_iter().collect();
        effects.extend(self.on_tick(now_unix_ns));
        effects
    }

    /// Handles the result of an effect; results for screens that were closed are ignored.
    pub(crate) fn on_answer(&mut self, answer: TaskResult) {
        match answer {
            TaskResult::Order(request, outcome) => {
                self.notice = Some(Notice::ended(&request, &outcome))
            }
            TaskResult::Frame(of, frame) => {
                if let Some(seen) = self.close_up_of(&of) {
                    seen.frame = frame.map_or_else(Fetched::Missing, Fetched::Here);
                }
            }
            TaskResult::Identification(of, found) => {
                if let Some(seen) = self.close_up_of(&of) {
                    seen.identification = found.map_or_else(Fetched::Missing, Fetched::Here);
                }
            }
            TaskResult::History(of, history) => {
                if let Some(journal) = self.journal_of(&of) {
                    journal.accept(&history);
                }
            }
            TaskResult::Divergences(message) => {
                if self.frozen.is_none()
                    && let Some(seen) = &mut self.close_up
                {
                    seen.listen(&message);
                }
            }
        }
    }

    fn close_up_of(&mut self, subject: &ComponentId) -> Option<&mut CloseUp> {
        self.close_up.as_deref_mut().filter(|seen| seen.subject == *subject)
    }

    fn journal_of(&mut self, subject: &ComponentId) -> Option<&mut ComponentHistory> {
        self.journal.as_deref_mut().filter(|journal| journal.subject == *subject)
    }

    fn questions(&mut self) -> Vec<ModelEffect> {
        let scene = self.scene.clone();
        let Some(seen) = &mut self.close_up else { return Vec::new() };
        let present = scene.state_of(&seen.subject);
        present.map_or_else(Vec::new, |present| seen.questions(present, self.now_unix_ns))
    }
}
