//! The request to end, from a signal or from the owner of a process that runs as a task.

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::{oneshot, watch};

/// Asks every holder of the [`Shutdown`] to end, on request or when dropped.
#[derive(Debug)]
pub struct Trigger(watch::Sender<bool>);

/// Whether the end was requested.
#[derive(Debug, Clone)]
pub struct Shutdown(watch::Receiver<bool>);

/// A trigger and what it triggers.
#[must_use]
pub fn pair() -> (Trigger, Shutdown) {
    let (sender, receiver) = watch::channel(false);
    (Trigger(sender), Shutdown(receiver))
}

impl Trigger {
    /// Asks for the end.
    pub fn pull(&self) {
        self.0.send_replace(true);
    }
}

impl Shutdown {
    /// Waits until the end is asked for.
    pub async fn requested(&mut self) {
        // An error means that the trigger is gone, which asks for the end too.
        let _ = self.0.wait_for(|requested| *requested).await;
    }

    /// Was the end asked for?
    #[must_use]
    pub fn is_requested(&self) -> bool {
        *self.0.borrow() || self.0.has_changed().is_err()
    }
}

/// What may ask a process to end, besides signals.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub struct ShutdownFlags {
    /// End when standard input is closed, as when the parent process ends in any way
    #[arg(long)]
    pub end_with_stdin: bool,
}

/// A shutdown that SIGTERM, SIGINT and what the flags say trigger.
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
                // An error means that the reading thread is gone, with standard input.
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

/// Resolves when nothing more can come from standard input. A thread of its own waits for that, which
/// keeps no process from ending as a task of the runtime would.
fn end_of_stdin() -> std::io::Result<oneshot::Receiver<()>> {
    let (closed, receiver) = oneshot::channel();
    std::thread::Builder::new().name("stdin".into()).spawn(move || {
        // Input is ignored; an error is an end too.
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
        assert!(shutdown.is_requested());
    }
}
