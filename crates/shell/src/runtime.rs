//! The async runtime of a process.

use std::any::Any;
use std::cell::Cell;
use std::future::Future;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use crate::environment;
use crate::exit::Failure;
use crate::shutdown::{self, Shutdown, ShutdownFlags};
use crate::supervision::scheduling;

/// Timeout for tasks to end at shutdown.
const ENDING: Duration = Duration::from_millis(500);

thread_local! {
    /// Whether a panic on this thread is caught and affects only the present work.
    static CONTAINED: Cell<bool> = const { Cell::new(false) };
}

/// Runs work whose panic the process survives. The work must not leave inconsistent state behind.
///
/// # Errors
/// The message of the panic.
pub fn contained<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    CONTAINED.set(true);
    let outcome = catch_unwind(AssertUnwindSafe(work));
    CONTAINED.set(false);
    outcome.map_err(|panic| message(&*panic))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "panic without a message".to_owned())
}

/// Runs a process until it ends. SIGTERM, SIGINT, the flags and a panic on any thread, including threads of libraries,
/// request shutdown; after a panic the service manager restarts the process.
///
/// # Errors
/// The process failed, a part of it panicked, or the runtime cannot be created.
pub fn until_done<F>(
    flags: ShutdownFlags,
    process: impl FnOnce(Shutdown) -> F,
) -> Result<(), Failure>
where
    F: Future<Output = Result<(), Failure>>,
{
    environment::raise_descriptor_limit();
    scheduling::log();
    environment::log();
    // Zenoh needs more than one worker thread.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::running("the runtime cannot be started", error))?;
    let shutdown = runtime
        .block_on(async { shutdown::on_request(flags) })
        .map_err(|error| Failure::running("cannot install signal handlers", error))?;
    end_on_panic(shutdown.clone());
    let outcome = end_of(|| runtime.block_on(process(shutdown.clone())), &shutdown);
    // A task that never yields, e.g. a session waiting for its router, must not prevent the process from ending.
    runtime.shutdown_timeout(ENDING);
    outcome
}

/// The outcome of the process. After a panic elsewhere, e.g. because it poisoned a lock in Zenoh, this thread may panic
/// as well while it closes the session: the first panic is reported.
fn end_of(
    process: impl FnOnce() -> Result<(), Failure>,
    shutdown: &Shutdown,
) -> Result<(), Failure> {
    match catch_unwind(AssertUnwindSafe(process)) {
        Ok(outcome) => outcome?,
        Err(panic) => {
            let reason = shutdown.failure().unwrap_or_else(|| message(&*panic));
            return Err(Failure::Running(reason));
        }
    }
    shutdown.failure().map_or(Ok(()), |reason| Err(Failure::Running(reason)))
}

fn end_on_panic(shutdown: Shutdown) {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        report(panic);
        if CONTAINED.get() {
            return;
        }
        let thread = std::thread::current();
        let name = thread.name().unwrap_or("without a name");
        shutdown.fail(format!("the thread `{name}` has panicked"));
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_panic_that_is_not_contained_ends_the_process() {
        let (_trigger, shutdown) = shutdown::pair();
        end_on_panic(shutdown.clone());
        assert_eq!(contained(|| 7), Ok(7));
        let failed: Result<(), String> = contained(|| panic!("minimum {} above maximum", 3));
        assert_eq!(failed, Err("minimum 3 above maximum".to_owned()));
        assert_eq!(shutdown.failure(), None);
        let panics = std::thread::Builder::new().name("worker".into());
        panics.spawn(|| panic!("on purpose")).unwrap().join().unwrap_err();
        assert_eq!(shutdown.failure().unwrap(), "the thread `worker` has panicked");
        // As Zenoh does when its session is closed after that.
        let Err(Failure::Running(reason)) = end_of(|| panic!("PoisonError"), &shutdown) else {
            panic!("a process that panicked ended without a failure");
        };
        assert_eq!(reason, "the thread `worker` has panicked");
        let _ = std::panic::take_hook();
    }
}
