//! Takes over the terminal, and restores it however the process ends: by a key, a signal, an error or a panic.

use std::io::{self, Stdout, Write, stdout};
use std::mem::ManuallyDrop;
use std::panic;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

use nix::sys::signal::{Signal, raise};
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::{Hide, Show};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};

use crate::model::Model;
use crate::view;

static PANICKED: AtomicBool = AtomicBool::new(false);
static HOOK: Once = Once::new();

/// The terminal while the view controls it.
pub(super) struct Screen {
    /// Not dropped: it would only show the cursor, as this does, and panic if standard error is gone with the terminal.
    terminal: ManuallyDrop<Terminal<CrosstermBackend<Stdout>>>,
}

/// Whether any thread or task panicked, upon which the terminal was restored.
pub(super) fn has_panicked() -> bool {
    PANICKED.load(Ordering::Acquire)
}

impl Screen {
    /// Takes over the terminal.
    ///
    /// # Errors
    /// The output is not a terminal or cannot be written; it is left as it was.
    pub(super) fn enter() -> io::Result<Self> {
        HOOK.call_once(|| {
            let former = panic::take_hook();
            panic::set_hook(Box::new(move |what| {
                PANICKED.store(true, Ordering::Release);
                leave();
                former(what);
            }));
        });
        enter().inspect_err(|_| leave())?;
        match Terminal::new(CrosstermBackend::new(stdout())) {
            Ok(terminal) => Ok(Self { terminal: ManuallyDrop::new(terminal) }),
            Err(error) => {
                leave();
                Err(error)
            }
        }
    }

    pub(super) fn draw(&mut self, model: &Model) -> io::Result<()> {
        self.terminal.draw(|frame| view::draw(model, frame.area(), frame.buffer_mut()))?;
        Ok(())
    }

    /// Restores the terminal and stops until the process is continued.
    pub(super) fn suspend(&mut self) -> io::Result<()> {
        leave();
        raise(Signal::SIGSTOP)?;
        self.enter_again()
    }

    /// Takes over the terminal again after other programs may have used it.
    pub(super) fn enter_again(&mut self) -> io::Result<()> {
        enter()?;
        // Redraws everything. `clear` would query the cursor's position, and the keyboard thread would consume the
        // reply.
        let size = self.terminal.size()?;
        self.terminal.resize(size.into())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        leave();
    }
}

fn enter() -> io::Result<()> {
    enable_raw_mode()?;
    execute!(stdout(), EnterAlternateScreen, Hide)
}

/// Restores as much as possible: the terminal may be gone.
fn leave() {
    let _ = execute!(stdout(), Show, LeaveAlternateScreen);
    let _ = disable_raw_mode();
    let _ = stdout().flush();
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// Set for the process that panics.
    const PANICS: &str = "TRUSSWATCH_TEST_PANICS";
    const NAME: &str = "station::screen::tests::a_panic_of_any_thread_gives_the_terminal_back";

    /// With a terminal of its own, which `script` (util-linux) makes.
    #[test]
    #[ignore = "needs `script` of util-linux"]
    fn a_panic_of_any_thread_gives_the_terminal_back() {
        if std::env::var_os(PANICS).is_some() {
            let _screen = Screen::enter().unwrap();
            assert!(std::thread::spawn(|| panic!("deliberate")).join().is_err());
            assert!(has_panicked());
            // Nothing else gives it back.
            std::process::exit(0);
        }
        let program = std::env::current_exe().unwrap();
        let command =
            format!("{} --exact {NAME} --ignored --nocapture; stty -a", program.display());
        let run = Command::new("script")
            .args(["-q", "-e", "-c", &command, "/dev/null"])
            .env(PANICS, "1")
            .output()
            .unwrap();
        let seen = String::from_utf8_lossy(&run.stdout);
        let places = ["\x1b[?1049h", "\x1b[?1049l", "deliberate"].map(|text| seen.find(text));
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{places:?} in {seen:?}");
        assert!(seen.contains(" icanon") && !seen.contains("-icanon"), "{seen:?}");
    }
}
