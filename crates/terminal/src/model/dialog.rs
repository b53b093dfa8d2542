//! The dialog for an order: duration, reason, and a confirmation of the command.

use observer::{ComponentId, OrderRequest};
use ratatui::crossterm::event::KeyCode;
use vocabulary::words::printable;
use vocabulary::{Order, OrderKind};

use crate::OrderIssuer;

/// Default duration of shelving.
const USUAL_SPAN: &str = "2h";

/// The field that has the focus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stage {
    Span,
    Note,
    Confirm,
}

/// An order being entered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Dialog {
    pub(crate) subject: ComponentId,
    pub(crate) kind: OrderKind,
    issuer: OrderIssuer,
    pub(crate) stage: Stage,
    pub(crate) span: String,
    pub(crate) note: String,
    /// What is wrong with the input.
    pub(crate) problem: Option<String>,
}

/// The result of a key in the dialog.
#[derive(Debug, PartialEq)]
pub(crate) enum Turn {
    Stay,
    Cancel,
    Send(Box<OrderRequest>),
}

impl Dialog {
    pub(crate) fn new(subject: ComponentId, kind: OrderKind, issuer: OrderIssuer) -> Self {
        let stage = if kind.sets_aside() { Stage::Span } else { Stage::Note };
        let (span, note, problem) = (USUAL_SPAN.to_owned(), String::new(), None);
        Self { subject, kind, issuer, stage, span, note, problem }
    }

    pub(crate) fn on_key(&mut self, key: KeyCode) -> Turn {
        match key {
            KeyCode::Esc => return Turn::Cancel,
            KeyCode::Enter => return self.next(),
            KeyCode::Char(character) => {
                self.text().into_iter().for_each(|text| text.push(character))
            }
            KeyCode::Backspace => {
                self.text().map(String::pop);
            }
            KeyCode::Up | KeyCode::BackTab => self.back(),
            _ => {}
        }
        Turn::Stay
    }

    /// Clears the line being typed.
    pub(crate) fn clear_line(&mut self) {
        self.text().into_iter().for_each(String::clear);
    }

    fn text(&mut self) -> Option<&mut String> {
        match self.stage {
            Stage::Span => Some(&mut self.span),
            Stage::Note => Some(&mut self.note),
            Stage::Confirm => None,
        }
    }

    fn back(&mut self) {
        self.problem = None;
        self.stage = match self.stage {
            Stage::Confirm => Stage::Note,
            Stage::Note if self.kind.sets_aside() => Stage::Span,
            stage => stage,
        };
    }

    fn next(&mut self) -> Turn {
        self.problem = None;
        match (self.stage, self.order()) {
            (Stage::Span, _) => {
                self.problem = self.seconds().err();
                if self.problem.is_none() {
                    self.stage = Stage::Note;
                }
            }
            (Stage::Note, Ok(_)) => self.stage = Stage::Confirm,
            (_, Err(problem)) => self.problem = Some(problem),
            (Stage::Confirm, Ok(order)) => {
                let ComponentId { structure, component } = self.subject.clone();
                let (module, operator) = (component.module, self.issuer.operator.clone());
                let request = OrderRequest { structure, module, kind: self.kind, operator, order };
                return Turn::Send(Box::new(request));
            }
        }
        Turn::Stay
    }

    fn seconds(&self) -> Result<Option<u64>, String> {
        if !self.kind.sets_aside() {
            return Ok(None);
        }
        let wrong = || {
            format!("invalid time span `{}`: expected e.g. 90min, 2h or 1d", printable(&self.span))
        };
        humantime::parse_duration(self.span.trim())
            .map(|span| Some(span.as_secs()))
            .map_err(|_| wrong())
    }

    /// The order that would be sent.
    pub(crate) fn order(&self) -> Result<Order, String> {
        let note = Some(self.note.trim().to_owned()).filter(|note| !note.is_empty());
        if self.kind.sets_aside() && note.is_none() {
            return Err("a reason is needed: type why".to_owned());
        }
        let component = Some(self.subject.component.component.clone().into());
        let (by, for_s) = (self.issuer.by.clone(), self.seconds()?);
        let order = Order { component, by, note, for_s, ..Order::default() };
        order.check(self.kind)?;
        Ok(order)
    }

    /// A description of the order.
    pub(crate) fn words(&self) -> String {
        let Self { subject, kind, issuer, span, note, .. } = self;
        let span = if kind.sets_aside() {
            format!(" for {}", printable(span.trim()))
        } else {
            String::new()
        };
        let note = printable(note.trim());
        let why = if note.is_empty() { ", without a note".to_owned() } else { format!(": {note}") };
        let (kind, by) = (kind.as_str(), printable(&issuer.by));
        format!("{kind} {} of {}{span} by {by}{why}", subject.component, subject.structure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dialog(kind: OrderKind) -> Dialog {
        let component = "m1/sensor/g2".parse().unwrap();
        Dialog::new(
            ComponentId { structure: "tower".parse().unwrap(), component },
            kind,
            OrderIssuer { by: "ada".to_owned(), operator: None },
        )
    }

    fn typed(dialog: &mut Dialog, text: &str) -> Turn {
        text.chars().for_each(|c| drop(dialog.on_key(KeyCode::Char(c))));
        dialog.on_key(KeyCode::Enter)
    }

    #[test]
    fn an_order_is_sent_only_after_it_was_shown_once_more() {
        let mut dialog = dialog(OrderKind::Acknowledge);
        assert_eq!(typed(&mut dialog, "seen"), Turn::Stay);
        assert_eq!(dialog.stage, Stage::Confirm);
        assert_eq!(dialog.words(), "acknowledge m1/sensor/g2 of tower by ada: seen");
        let Turn::Send(given) = dialog.on_key(KeyCode::Enter) else { panic!("{dialog:?}") };
        assert_eq!((given.order.by.as_str(), given.order.note.as_deref()), ("ada", Some("seen")));
        assert_eq!((given.kind, given.order.for_s), (OrderKind::Acknowledge, None));
    }

    #[test]
    fn shelving_needs_a_time_that_is_one_and_a_reason() {
        let mut dialog = dialog(OrderKind::Shelve);
        typed(&mut dialog, "x");
        assert_eq!(
            dialog.problem.as_deref(),
            Some("invalid time span `2hx`: expected e.g. 90min, 2h or 1d")
        );
        dialog.clear_line();
        typed(&mut dialog, "90min");
        assert_eq!((dialog.stage, &dialog.problem), (Stage::Note, &None));
        typed(&mut dialog, " ");
        assert_eq!(dialog.problem.as_deref(), Some("a reason is needed: type why"));
        typed(&mut dialog, "painting");
        assert_eq!(dialog.words(), "shelve m1/sensor/g2 of tower for 90min by ada: painting");
        let Turn::Send(given) = dialog.on_key(KeyCode::Enter) else { panic!("{dialog:?}") };
        assert_eq!(given.order.for_s, Some(5400));
    }

    #[test]
    fn a_time_that_no_diagnoser_takes_is_refused_before_anything_is_sent() {
        let mut dialog = dialog(OrderKind::Shelve);
        dialog.clear_line();
        typed(&mut dialog, "40d");
        typed(&mut dialog, "painting");
        let problem = dialog.problem.clone().unwrap();
        assert!(problem.contains("use 1 to 2678400 seconds"), "{problem}");
        assert_ne!(dialog.stage, Stage::Confirm);
    }

    #[test]
    fn escape_sends_nothing() {
        let mut dialog = dialog(OrderKind::Reset);
        typed(&mut dialog, "repaired");
        assert_eq!(dialog.on_key(KeyCode::Esc), Turn::Cancel);
    }
}
