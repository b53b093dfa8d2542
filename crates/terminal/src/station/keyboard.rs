//! Reads keys on a separate thread, because reading blocks.

use std::io;
use std::thread;

use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, read};
use tokio::sync::mpsc::{Receiver, channel};

/// Capacity of the key queue.
const QUEUE: usize = 256;

/// Input from the terminal.
#[derive(Debug, PartialEq)]
pub(super) enum KeyboardInput {
    Press(KeyCode),
    /// A letter with the control key.
    Control(char),
    Resized,
    Broken(String),
}

/// Reads until the process ends.
///
/// # Errors
/// The thread cannot be started.
pub(super) fn start() -> io::Result<Receiver<KeyboardInput>> {
    let (outlet, inbox) = channel(QUEUE);
    thread::Builder::new().name("keyboard".to_owned()).spawn(move || {
        loop {
            let (inputs, is_broken) = match read() {
                Ok(event) => (inputs(&event), false),
                Err(error) => (vec![KeyboardInput::Broken(error.to_string())], true),
            };
            let is_over = inputs.into_iter().any(|input| outlet.blocking_send(input).is_err());
            if is_over || is_broken {
                return;
            }
        }
    })?;
    Ok(inbox)
}

fn inputs(event: &Event) -> Vec<KeyboardInput> {
    match event {
        Event::Key(event) if event.kind != KeyEventKind::Release => keys(*event),
        Event::Resize(..) => vec![KeyboardInput::Resized],
        _ => Vec::new(),
    }
}

/// Terminals send the same sequence for Alt with a key as for Esc followed by that key; it is read as the latter.
fn keys(event: KeyEvent) -> Vec<KeyboardInput> {
    let escape = event.modifiers.contains(KeyModifiers::ALT).then_some(KeyCode::Esc);
    let key = match event.code {
        KeyCode::Char(letter) if event.modifiers.contains(KeyModifiers::CONTROL) => {
            Some(KeyboardInput::Control(letter))
        }
        KeyCode::Char(character) if !vocabulary::is_printable(character) => None,
        other => Some(KeyboardInput::Press(other)),
    };
    escape.map(KeyboardInput::Press).into_iter().chain(key).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    use super::KeyboardInput::{Control, Press};

    fn read_as(code: KeyCode, modifiers: KeyModifiers) -> Vec<KeyboardInput> {
        inputs(&Event::Key(KeyEvent::new(code, modifiers)))
    }

    #[test]
    fn escape_and_a_key_in_one_go_are_two_keys() {
        let read = read_as(KeyCode::Char('f'), KeyModifiers::ALT);
        assert_eq!(read, [Press(KeyCode::Esc), Press(KeyCode::Char('f'))]);
    }

    #[test]
    fn control_keys_are_no_letters_and_invisible_characters_are_nothing() {
        assert_eq!(read_as(KeyCode::Char('c'), KeyModifiers::CONTROL), [Control('c')]);
        assert_eq!(read_as(KeyCode::Char('G'), KeyModifiers::SHIFT), [Press(KeyCode::Char('G'))]);
        assert_eq!(read_as(KeyCode::Char('\u{202e}'), KeyModifiers::NONE), []);
    }
}
