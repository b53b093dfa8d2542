//! Signals that end, suspend and continue the process.

use std::io;

use tokio::signal::unix::{Signal as Stream, SignalKind, signal};

/// The request that a signal makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ProcessSignal {
    End,
    Suspend,
    Continued,
}

/// The handled signals.
#[derive(Debug)]
pub(super) struct ProcessSignals {
    terminate: Stream,
    interrupt: Stream,
    hang_up: Stream,
    stop: Stream,
    continued: Stream,
}

impl ProcessSignals {
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

    /// The next signal; cancel-safe.
    pub(super) async fn next(&mut self) -> ProcessSignal {
        tokio::select! {
            _ = self.terminate.recv() => ProcessSignal::End,
            _ = self.interrupt.recv() => ProcessSignal::End,
            _ = self.hang_up.recv() => ProcessSignal::End,
            _ = self.stop.recv() => ProcessSignal::Suspend,
            _ = self.continued.recv() => ProcessSignal::Continued,
        }
    }
}
