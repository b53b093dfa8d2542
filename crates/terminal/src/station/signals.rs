//! What ends, suspends and continues the process.

use std::io;

use tokio::signal::unix::{Signal as Stream, SignalKind, signal};

/// What a signal asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Signal {
    End,
    Suspend,
    Continued,
}

/// The signals that are handled.
#[derive(Debug)]
pub(super) struct Signals {
    terminate: Stream,
    interrupt: Stream,
    hang_up: Stream,
    stop: Stream,
    continued: Stream,
}

impl Signals {
    /// # Errors
    /// The handlers cannot be installed.
    pub(super) fn new() -> io::Result<Self> {
        use nix::sys::signal::Signal::{SIGCONT, SIGTSTP};
        Ok(Self {
            terminate: signal(SignalKind::terminate())?,
            interrupt: signal(SignalKind::interrupt())?,
            hang_up: signal(SignalKind::hangup())?,
            stop: signal(SignalKind::from_raw(SIGTSTP as i32))?,
            continued: signal(SignalKind::from_raw(SIGCONT as i32))?,
        })
    }

    /// The next; may be given up at any time.
    pub(super) async fn next(&mut self) -> Signal {
        tokio::select! {
            _ = self.terminate.recv() => Signal::End,
            _ = self.interrupt.recv() => Signal::End,
            _ = self.hang_up.recv() => Signal::End,
            _ = self.stop.recv() => Signal::Suspend,
            _ = self.continued.recv() => Signal::Continued,
        }
    }
}
