//! Keys, read on a thread of their own: reading waits.

use std::io;
use std::thread;

use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, read};
use tokio::sync::mpsc::{Receiver, channel};

use crate::model::Key;

/// Keys that may wait to be looked at.
const QUEUE: usize = 256;

/// What comes from the terminal.
#[derive(Debug)]
pub(super) enum Input {
    Key(Key),
    Resized,
    Broken(String),
}

/// Reads until the process ends.
///
/// # Errors
/// The thread cannot be started.
pub(super) fn start() -> io::Result<Receiver<Input>> {
    let (outlet, inbox) = channel(QUEUE);
    thread::Builder::new().name("keyboard".to_owned()).spawn(move || {
        loop {
            let (inputs, is_broken) = match read() {
                Ok(event) => (inputs(&event), false),
                Err(error) => (vec![Input::Broken(error.to_string())], true),
            };
            let is_over = inputs.into_iter().any(|input| outlet.blocking_send(input).is_err());
            if is_over || is_broken {
                return;
            }
        }
    })?;
    Ok(inbox)
}

fn inputs(event: &Event) -> Vec<Input> {
    match event {
        Event::Key(event) if event.kind != KeyEventKind::Release => keys(*event),
        Event::Resize(..) => vec![Input::Resized],
        _ => Vec::new(),
    }
}

/// A terminal sends the same for Alt with a key as for Esc and then that key; here it is the latter.
fn keys(event: KeyEvent) -> Vec<Input> {
    let escape = event.modifiers.contains(KeyModifiers::ALT).then_some(Key::Esc);
    escape.into_iter().chain(key(event)).map(Input::Key).collect()
}

fn key(event: KeyEvent) -> Option<Key> {
    Some(match event.code {
        KeyCode::Char(character) if event.modifiers.contains(KeyModifiers::CONTROL) => {
            Key::Control(character)
        }
        KeyCode::Char(character) if vocabulary::is_printable(character) => Key::Char(character),
        KeyCode::Up => Key::Up,
        KeyCode::Down => Key::Down,
        KeyCode::PageUp => Key::PageUp,
        KeyCode::PageDown => Key::PageDown,
        KeyCode::Home => Key::Home,
        KeyCode::End => Key::End,
        KeyCode::Enter => Key::Enter,
        KeyCode::Esc => Key::Esc,
        KeyCode::Tab => Key::Tab,
        KeyCode::BackTab => Key::BackTab,
        KeyCode::Backspace => Key::Backspace,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_as(code: KeyCode, modifiers: KeyModifiers) -> Vec<Key> {
        let inputs = inputs(&Event::Key(KeyEvent::new(code, modifiers)));
        let key = |input| if let Input::Key(key) = input { Some(key) } else { None };
        inputs.into_iter().filter_map(key).collect()
    }

    #[test]
    fn escape_and_a_key_in_one_go_are_two_keys() {
        let read = read_as(KeyCode::Char('f'), KeyModifiers::ALT);
        assert_eq!(read, [Key::Esc, Key::Char('f')]);
    }

    #[test]
    fn control_keys_are_no_letters_and_invisible_characters_are_nothing() {
        assert_eq!(read_as(KeyCode::Char('c'), KeyModifiers::CONTROL), [Key::Control('c')]);
        assert_eq!(read_as(KeyCode::Char('G'), KeyModifiers::SHIFT), [Key::Char('G')]);
        assert_eq!(read_as(KeyCode::Char('\u{202e}'), KeyModifiers::NONE), []);
    }
}
