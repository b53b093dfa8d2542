//! The effect of each key.

use observer::{ComponentId, ModuleId, RowId};
use ratatui::crossterm::event::KeyCode;
use vocabulary::OrderKind;
use vocabulary::words::Tone;

use super::ModelEffect;
use super::close_up::CloseUp;
use super::dialog::{Dialog, Turn};
use super::history::ComponentHistory;
use super::{Model, Notice, Pane};

/// Rows per page.
const PAGE: isize = 10;

impl Model {
    /// Handles a letter with the control key: quits, suspends, or clears the line being typed.
    pub(crate) fn on_control(&mut self, letter: char) -> Vec<ModelEffect> {
        match letter {
            'c' => return vec![ModelEffect::Quit],
            'z' => return vec![ModelEffect::Suspend],
            'u' => {
                if let Some(dialog) = &mut self.dialog {
                    dialog.clear_line();
                } else if self.types_filter {
                    self.filter.clear();
                }
            }
            _ => {}
        }
        Vec::new()
    }

    /// Handles a key.
    pub(crate) fn on_key(&mut self, key: KeyCode) -> Vec<ModelEffect> {
        if self.dialog.is_some() {
            self.word_order(key)
        } else if self.types_filter {
            self.type_filter(key);
            Vec::new()
        } else if self.helps {
            self.helps = false;
            Vec::new()
        } else {
            self.command(key)
        }
    }

    fn command(&mut self, key: KeyCode) -> Vec<ModelEffect> {
        match key {
            KeyCode::Char('q') => return vec![ModelEffect::Quit],
            KeyCode::Char('?') => self.helps = true,
            KeyCode::Char('f' | ' ') => self.freeze(),
            KeyCode::Char('/') if !self.is_close() => self.types_filter = true,
            KeyCode::Char('a') => self.begin(OrderKind::Acknowledge),
            KeyCode::Char('r') => self.begin(OrderKind::Reset),
            KeyCode::Char('s') => self.begin(OrderKind::Shelve),
            KeyCode::Char('u') => self.begin(OrderKind::Unshelve),
            KeyCode::Char('h') => return self.open_journal(),
            KeyCode::Enter => return self.open(),
            KeyCode::Esc => return self.back(),
            KeyCode::Tab => self.pane = after(self.pane),
            KeyCode::BackTab => self.pane = after(after(self.pane)),
            _ => {
                if let Some(by) = rows_moved(key) {
                    self.notice = None;
                    self.step(by);
                }
            }
        }
        Vec::new()
    }

    /// Whether another screen covers the lists.
    fn is_close(&self) -> bool {
        self.close_up.is_some() || self.journal.is_some()
    }

    fn freeze(&mut self) {
        self.frozen = match self.frozen {
            Some(_) => None,
            None => Some(self.scene.clone()),
        };
    }

    fn step(&mut self, by: isize) {
        if let Some(journal) = &mut self.journal {
            return journal.step(by);
        }
        if self.close_up.is_some() {
            return;
        }
        match self.pane {
            Pane::Modules => {
                let rows = self.modules();
                self.module_cursor.step(&rows, by);
            }
            Pane::Faults => {
                let rows = self.rows();
                self.fault_cursor.step(&rows, by);
            }
            Pane::Events => {
                let last = self.shown().events.len().saturating_sub(1);
                let by = by.checked_neg().unwrap_or(isize::MAX);
                self.events_back = self.events_back.saturating_add_signed(by).min(last);
            }
        }
    }

    /// The selected component, if a component is selected.
    fn selected(&self) -> Option<ComponentId> {
        if let Some(journal) = &self.journal {
            return Some(journal.subject.clone());
        }
        if let Some(seen) = &self.close_up {
            return Some(seen.subject.clone());
        }
        let rows = self.rows();
        match self.fault_cursor.row(&rows)? {
            RowId::Component(subject) if self.pane == Pane::Faults => Some(subject.clone()),
            _ => None,
        }
    }

    fn open(&mut self) -> Vec<ModelEffect> {
        if self.is_close() {
            return Vec::new();
        }
        if self.pane == Pane::Modules {
            let rows = self.modules();
            self.narrow(self.module_cursor.row(&rows).cloned());
            return Vec::new();
        }
        if let Some(subject) = self.selected() {
            let seen = CloseUp::new(subject);
            let module = seen.subject.module();
            self.close_up = Some(Box::new(seen));
            let mut effects = vec![ModelEffect::Listen(Some(module))];
            effects.extend(self.questions());
            return effects;
        }
        let rows = self.rows();
        if let (Pane::Faults, Some(RowId::Module(whose))) =
            (self.pane, self.fault_cursor.row(&rows))
        {
            self.narrow(Some(whose.clone()));
        }
        Vec::new()
    }

    /// Lists only the components of one module.
    fn narrow(&mut self, scope: Option<ModuleId>) {
        if scope.is_some() {
            (self.scope, self.pane) = (scope, Pane::Faults);
        }
    }

    fn open_journal(&mut self) -> Vec<ModelEffect> {
        if self.journal.is_some() {
            return Vec::new();
        }
        let Some(subject) = self.selected() else {
            self.notice = Some(Notice::refusal("no component is selected"));
            return Vec::new();
        };
        self.journal = Some(Box::new(ComponentHistory::new(subject.clone())));
        vec![ModelEffect::History(subject)]
    }

    /// Goes back one step: closes what covers the lists, then clears what narrows them.
    fn back(&mut self) -> Vec<ModelEffect> {
        if self.journal.take().is_some() {
            return Vec::new();
        }
        if self.close_up.take().is_some() {
            return vec![ModelEffect::Listen(None)];
        }
        if self.scope.take().is_none() {
            if self.filter.trim().is_empty() {
                self.notice = None;
            }
            self.filter.clear();
        }
        Vec::new()
    }

    fn type_filter(&mut self, key: KeyCode) {
        match key {
            KeyCode::Char(character) => self.filter.push(character),
            KeyCode::Backspace => {
                self.filter.pop();
            }
            KeyCode::Enter => (self.types_filter, self.pane) = (false, Pane::Faults),
            KeyCode::Esc => {
                self.types_filter = false;
                self.filter.clear();
            }
            _ => {}
        }
    }

    /// Opens the dialog for an order about the selection.
    fn begin(&mut self, kind: OrderKind) {
        let issuer = match &self.settings.issuer {
            Ok(issuer) => issuer.clone(),
            Err(reason) => {
                let text = format!("commands disabled: {reason}");
                self.notice = Some(Notice { tone: Tone::Alarm, text });
                return;
            }
        };
        match self.selected() {
            Some(subject) => self.dialog = Some(Box::new(Dialog::new(subject, kind, issuer))),
            None => self.notice = Some(Notice::refusal("no component is selected")),
        }
    }

    fn word_order(&mut self, key: KeyCode) -> Vec<ModelEffect> {
        let Some(dialog) = &mut self.dialog else { return Vec::new() };
        match dialog.on_key(key) {
            Turn::Stay => Vec::new(),
            Turn::Cancel => {
                self.dialog = None;
                self.notice = Some(Notice::refusal("command not sent"));
                Vec::new()
            }
            Turn::Send(request) => {
                self.dialog = None;
                self.notice = Some(Notice::sent(&request));
                vec![ModelEffect::Order(*request)]
            }
        }
    }
}

/// The number of rows by which the key moves a selection, if it does.
fn rows_moved(key: KeyCode) -> Option<isize> {
    match key {
        KeyCode::Up | KeyCode::Char('k') => Some(-1),
        KeyCode::Down | KeyCode::Char('j') => Some(1),
        KeyCode::PageUp => Some(-PAGE),
        KeyCode::PageDown => Some(PAGE),
        KeyCode::Home | KeyCode::Char('g') => Some(isize::MIN),
        KeyCode::End | KeyCode::Char('G') => Some(isize::MAX),
        _ => None,
    }
}

fn after(pane: Pane) -> Pane {
    match pane {
        Pane::Modules => Pane::Faults,
        Pane::Faults => Pane::Events,
        Pane::Events => Pane::Modules,
    }
}
