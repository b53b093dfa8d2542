//! What each key does.

use vocabulary::OrderKind;
use vocabulary::words::Tone;

use super::close_up::CloseUp;
use super::dialog::{Dialog, Turn};
use super::exchange::Effect;
use super::journal::Journal;
use super::{Key, Model, Notice, Pane, Row, Subject, Whose};

impl Model {
    /// A key was pressed.
    pub(crate) fn on_key(&mut self, key: Key) -> Vec<Effect> {
        match key {
            Key::Control('c') => return vec![Effect::Quit],
            Key::Control('z') => return vec![Effect::Suspend],
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

    fn command(&mut self, key: Key) -> Vec<Effect> {
        match key {
            Key::Char('q') => return vec![Effect::Quit],
            Key::Char('?') => self.helps = true,
            Key::Char('f' | ' ') => self.freeze(),
            Key::Char('/') if !self.is_close() => self.types_filter = true,
            Key::Char('a') => self.begin(OrderKind::Acknowledge),
            Key::Char('r') => self.begin(OrderKind::Reset),
            Key::Char('s') => self.begin(OrderKind::Shelve),
            Key::Char('u') => self.begin(OrderKind::Unshelve),
            Key::Char('h') => return self.open_journal(),
            Key::Enter => return self.open(),
            Key::Esc => return self.back(),
            Key::Tab => self.pane = after(self.pane),
            Key::BackTab => self.pane = after(after(self.pane)),
            _ => {
                if let Some(by) = key.step() {
                    self.notice = None;
                    self.step(by);
                }
            }
        }
        Vec::new()
    }

    /// Whether something covers the lists.
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

    /// What is selected, where a component is.
    fn selected(&self) -> Option<Subject> {
        if let Some(journal) = &self.journal {
            return Some(journal.subject.clone());
        }
        if let Some(seen) = &self.close_up {
            return Some(seen.subject.clone());
        }
        let rows = self.rows();
        match self.fault_cursor.row(&rows)? {
            Row::Component(subject) if self.pane == Pane::Faults => Some(subject.clone()),
            _ => None,
        }
    }

    fn open(&mut self) -> Vec<Effect> {
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
            let module = seen.module();
            self.close_up = Some(Box::new(seen));
            let mut effects = vec![Effect::Listen(Some(module))];
            effects.extend(self.questions());
            return effects;
        }
        let rows = self.rows();
        if let (Pane::Faults, Some(Row::Module(whose))) = (self.pane, self.fault_cursor.row(&rows))
        {
            self.narrow(Some(whose.clone()));
        }
        Vec::new()
    }

    /// Lists the components of one module only.
    fn narrow(&mut self, scope: Option<Whose>) {
        if scope.is_some() {
            (self.scope, self.pane) = (scope, Pane::Faults);
        }
    }

    fn open_journal(&mut self) -> Vec<Effect> {
        if self.journal.is_some() {
            return Vec::new();
        }
        let Some(subject) = self.selected() else {
            self.notice = Some(Notice::refusal("no component is selected"));
            return Vec::new();
        };
        self.journal = Some(Box::new(Journal::new(subject.clone())));
        vec![Effect::History(subject)]
    }

    /// One step back: what covers the lists, then what narrows them.
    fn back(&mut self) -> Vec<Effect> {
        if self.journal.take().is_some() {
            return Vec::new();
        }
        if self.close_up.take().is_some() {
            return vec![Effect::Listen(None)];
        }
        if self.scope.take().is_none() {
            if self.filter.is_empty() {
                self.notice = None;
            }
            self.filter.0.clear();
        }
        Vec::new()
    }

    fn type_filter(&mut self, key: Key) {
        match key {
            Key::Char(character) => self.filter.0.push(character),
            Key::Backspace => {
                self.filter.0.pop();
            }
            Key::Control('u') => self.filter.0.clear(),
            Key::Enter => (self.types_filter, self.pane) = (false, Pane::Faults),
            Key::Esc => {
                self.types_filter = false;
                self.filter.0.clear();
            }
            _ => {}
        }
    }

    /// Begins to word an order about what is selected.
    fn begin(&mut self, kind: OrderKind) {
        let issuer = match &self.settings.issuer {
            Ok(issuer) => issuer.by.clone(),
            Err(reason) => {
                let text = format!("no orders from here: {reason}");
                self.notice = Some(Notice { tone: Tone::Alarm, text });
                return;
            }
        };
        match self.selected() {
            Some(subject) => self.dialog = Some(Box::new(Dialog::new(subject, kind, issuer))),
            None => self.notice = Some(Notice::refusal("no component is selected")),
        }
    }

    fn word_order(&mut self, key: Key) -> Vec<Effect> {
        let Some(dialog) = &mut self.dialog else { return Vec::new() };
        match dialog.on_key(key) {
            Turn::Stay => Vec::new(),
            Turn::Cancel => {
                self.dialog = None;
                self.notice = Some(Notice::refusal("nothing was sent"));
                Vec::new()
            }
            Turn::Send(given) => {
                self.dialog = None;
                self.notice = Some(Notice::sent(&given));
                vec![Effect::Order(*given)]
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
