//! Essential threads and tasks of a process. If one ends before shutdown was requested, by a panic or otherwise, the
//! process ends too, and the service manager restarts it.

use std::future::Future;
use std::sync::Arc;

use tokio::sync::oneshot;
use tokio::task::AbortHandle;

use super::pulse::{Lane, Pulse};
use crate::shutdown::Shutdown;

/// Starts essential threads and tasks.
#[derive(Debug, Clone)]
pub struct Crew {
    shutdown: Shutdown,
    pulse: Arc<Pulse>,
}

/// Resolves when the thread has ended.
pub type Ended = oneshot::Receiver<()>;

impl Crew {
    /// Threads and tasks of a process with this shutdown, whose progress goes to this pulse.
    #[must_use]
    pub fn new(shutdown: Shutdown, pulse: Arc<Pulse>) -> Self {
        Self { shutdown, pulse }
    }

    /// Starts a thread that reports the start of each piece of work.
    ///
    /// # Errors
    /// The system cannot start a thread.
    pub fn thread(
        &self,
        name: &'static str,
        work: impl FnOnce(&Lane) + Send + 'static,
    ) -> std::io::Result<Ended> {
        let (guard, lane) = (self.guard("thread", name), self.pulse.lane(name));
        let (ending, ended) = oneshot::channel();
        std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            let _guard = guard;
            work(&lane);
            // The receiver is gone if the process ends without waiting for the thread.
            let _ = ending.send(());
        })?;
        Ok(ended)
    }

    /// Starts a task that runs until it is aborted, which the owner has to do at shutdown.
    pub fn task(
        &self,
        name: &'static str,
        work: impl Future<Output = ()> + Send + 'static,
    ) -> AbortHandle {
        let guard = self.guard("task", name);
        let task = tokio::spawn(async move {
            let _guard = guard;
            work.await;
        });
        task.abort_handle()
    }

    fn guard(&self, kind: &'static str, name: &'static str) -> EndGuard {
        EndGuard { kind, name, shutdown: self.shutdown.clone() }
    }
}

/// Held while a thread or task runs.
struct EndGuard {
    kind: &'static str,
    name: &'static str,
    shutdown: Shutdown,
}

impl Drop for EndGuard {
    fn drop(&mut self) {
        if !self.shutdown.is_requested() {
            let Self { kind, name, .. } = self;
            let how = if std::thread::panicking() { "has panicked" } else { "has ended" };
            self.shutdown.fail(format!("the {kind} `{name}` {how}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shutdown;

    fn crew() -> (shutdown::Trigger, Crew) {
        let (trigger, shutdown) = shutdown::pair();
        (trigger, Crew::new(shutdown, Arc::new(Pulse::new())))
    }

    #[tokio::test]
    async fn whoever_ends_early_ends_the_process_and_is_named() {
        let panics: fn(&Lane) = |_| std::panic::resume_unwind(Box::new("out of order"));
        for (work, how) in [(panics, "has panicked"), (|_: &Lane| {}, "has ended")] {
            let (_trigger, crew) = crew();
            let mut shutdown = crew.shutdown.clone();
            let _ended = crew.thread("events", work).unwrap();
            shutdown.requested().await;
            assert_eq!(shutdown.failure(), Some(format!("the thread `events` {how}")));
        }
        let (_trigger, crew) = crew();
        let mut shutdown = crew.shutdown.clone();
        crew.task("presence", async {});
        shutdown.requested().await;
        assert_eq!(shutdown.failure().as_deref(), Some("the task `presence` has ended"));
    }

    #[tokio::test]
    async fn a_thread_that_ends_with_the_process_is_not_reported() {
        let (trigger, crew) = crew();
        let (end, ending) = std::sync::mpsc::channel::<()>();
        let until_told = move |_: &Lane| assert!(ending.recv().is_err());
        let ended = crew.thread("events", until_told).unwrap();
        let task = crew.task("presence", std::future::pending());
        trigger.pull();
        drop(end);
        ended.await.unwrap();
        task.abort();
        assert_eq!(crew.shutdown.failure(), None);
    }
}
