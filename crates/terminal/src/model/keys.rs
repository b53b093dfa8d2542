//! The effect of each key.

use observer::{ComponentId, ModuleId, RowId};
use vocabulary::OrderKind;
use vocabulary::words::Tone;

use super::close_up::CloseUp;
use super::dialog::{Dialog, Turn};
use super::effect::ModelEffect;
use super::history::ComponentHistory;
use super::{KeyPress, Model, Notice, Pane};

impl Model {
    /// Handles a key.
    pub(crate) fn on_key(&mut self, key: KeyPress) -> Vec<ModelEffect> {
        match key {
            KeyPress::Control('c') => return vec![ModelEffect::Quit],
            KeyPress::Control('z') => return vec![ModelEffect::Suspend],
            _ => {}
        }
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

    fn command(&mut self, key: KeyPress) -> Vec<ModelEffect> {
        match key {
            KeyPress::Char('q') => return vec![ModelEffect::Quit],
            KeyPress::Char('?') => self.helps = true,
            KeyPress::Char('f' | ' ') => self.freeze(),
            KeyPress::Char('/') if !self.is_close() => self.types_filter = true,
            KeyPress::Char('a') => self.begin(OrderKind::Acknowledge),
            KeyPress::Char('r') => self.begin(OrderKind::Reset),
            KeyPress::Char('s') => self.begin(OrderKind::Shelve),
            KeyPress::Char('u') => self.begin(OrderKind::Unshelve),
            KeyPress::Char('h') => return self.open_journal(),
            KeyPress::Enter => return self.open(),
            KeyPress::Esc => return self.back(),
            KeyPress::Tab => self.pane = after(self.pane),
            KeyPress::BackTab => self.pane = after(after(self.pane)),
            _ => {
                if let Some(by) = key.step() {
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

    fn type_filter(&mut self, key: KeyPress) {
        match key {
            KeyPress::Char(character) => self.filter.push(character),
            KeyPress::Backspace => {
                self.filter.pop();
            }
            KeyPress::Control('u') => self.filter.clear(),
            KeyPress::Enter => (self.types_filter, self.pane) = (false, Pane::Faults),
            KeyPress::Esc => {
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

    fn word_order(&mut self, key: KeyPress) -> Vec<ModelEffect> {
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

fn after(pane: Pane) -> Pane {
    match pane {
        Pane::Modules => Pane::Faults,
        Pane::Faults => Pane::Events,
        Pane::Events => Pane::Modules,
    }
}
