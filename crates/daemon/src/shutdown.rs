//! The request to end, from a signal or from whoever runs a process as a task.

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

/// Asks everybody who holds the [`Shutdown`] to end, when told to or when dropped.
#[derive(Debug)]
pub struct Trigger(watch::Sender<bool>);

/// Tells whether the end was asked for.
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

/// A shutdown that SIGTERM and SIGINT trigger.
///
/// # Errors
/// The handlers cannot be installed.
pub fn on_signals() -> std::io::Result<Shutdown> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let (trigger, shutdown) = pair();
    tokio::spawn(async move {
        let name = tokio::select! {
            _ = terminate.recv() => "SIGTERM",
            _ = interrupt.recv() => "SIGINT",
        };
        tracing::info!("{name}: stopping");
        trigger.pull();
    });
    Ok(shutdown)
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
