//! Requests shutdown: on a signal, by the owner of a process that runs as a task, or because an essential part of the
//! process failed.

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::{oneshot, watch};

/// The shutdown state of a process.
#[derive(Debug, Clone, PartialEq, Eq)]
enum End {
    NotYet,
    Requested,
    /// A part failed, for this reason.
    Failed(String),
}

/// Requests shutdown of all holders of the [`Shutdown`], explicitly or when dropped.
#[derive(Debug)]
pub struct Trigger(watch::Sender<End>);

/// Observes whether shutdown was requested.
#[derive(Debug, Clone)]
pub struct Shutdown {
    end: watch::Receiver<End>,
    failing: watch::Sender<End>,
}

/// A trigger and the shutdown that it controls.
#[must_use]
pub fn pair() -> (Trigger, Shutdown) {
    let (sender, end) = watch::channel(End::NotYet);
    let shutdown = Shutdown { end, failing: sender.clone() };
    (Trigger(sender), shutdown)
}

impl Trigger {
    /// Requests shutdown.
    pub fn pull(&self) {
        come_to(&self.0, End::Requested);
    }
}

impl Drop for Trigger {
    fn drop(&mut self) {
        self.pull();
    }
}

impl Shutdown {
    /// Waits until shutdown is requested.
    pub async fn requested(&mut self) {
        // Cannot fail, because this holds a sender.
        let _ = self.end.wait_for(|end| *end != End::NotYet).await;
    }

    /// Whether shutdown was requested.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        *self.end.borrow() != End::NotYet
    }

    /// Requests shutdown because of a failure. Failures after shutdown was requested are ignored.
    pub fn fail(&self, reason: String) {
        come_to(&self.failing, End::Failed(reason));
    }

    /// The failure that caused shutdown, if any.
    #[must_use]
    pub fn failure(&self) -> Option<String> {
        match &*self.end.borrow() {
            End::Failed(reason) => Some(reason.clone()),
            End::NotYet | End::Requested => None,
        }
    }
}

/// Keeps the first reason.
fn come_to(sender: &watch::Sender<End>, end: End) {
    sender.send_if_modified(|present| {
        let is_first = *present == End::NotYet;
        if is_first {
            *present = end;
        }
        is_first
    });
}

/// What may ask a process to end, besides signals.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct ShutdownFlags {
    /// End when standard input is closed, as when the parent process ends in any way
    #[arg(long)]
    pub end_with_stdin: bool,
}

/// A shutdown that is requested by SIGTERM, SIGINT and the flags.
///
/// # Errors
/// The handlers cannot be installed, or the thread that reads standard input cannot be started.
pub fn on_request(flags: ShutdownFlags) -> std::io::Result<Shutdown> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let stdin = if flags.end_with_stdin { Some(end_of_stdin()?) } else { None };
    let (trigger, shutdown) = pair();
    tokio::spawn(async move {
        let closed = async {
            match stdin {
                // An error means that the reading thread has ended, as it does when standard input closes.
                Some(closed) => drop(closed.await),
                None => std::future::pending().await,
            }
        };
        let name = tokio::select! {
            _ = terminate.recv() => "SIGTERM",
            _ = interrupt.recv() => "SIGINT",
            () = closed => "standard input closed",
        };
        tracing::info!("{name}: stopping");
        trigger.pull();
    });
    Ok(shutdown)
}

/// Resolves when standard input is closed. A separate thread waits for that, because a blocking task of the runtime
/// would keep the process from ending.
fn end_of_stdin() -> std::io::Result<oneshot::Receiver<()>> {
    let (closed, receiver) = oneshot::channel();
    std::thread::Builder::new().name("stdin".into()).spawn(move || {
        // Input is ignored; an error also counts as closing.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        let _ = closed.send(());
    })?;
    Ok(receiver)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn pulling_or_dropping_the_trigger_asks_for_the_end() {
        let (trigger, mut shutdown) = pair();
        assert!(!shutdown.is_requested());
        trigger.pull();
        shutdown.requested().await;
        assert!(shutdown.is_requested());
        let (trigger, mut shutdown) = pair();
        drop(trigger);
        shutdown.requested().await;
        assert!(shutdown.is_requested() && shutdown.failure().is_none());
    }

    #[tokio::test]
    async fn the_first_failure_is_the_reason_unless_the_end_was_asked_for_before() {
        let (_trigger, mut shutdown) = pair();
        shutdown.clone().fail("first".to_owned());
        shutdown.fail("second".to_owned());
        shutdown.requested().await;
        assert_eq!(shutdown.failure().as_deref(), Some("first"));
        let (trigger, shutdown) = pair();
        trigger.pull();
        shutdown.fail("late".to_owned());
        assert_eq!(shutdown.failure(), None);
    }
}
