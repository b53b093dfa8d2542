//! The runtime that a process runs on.

use std::future::Future;
use std::time::Duration;

use crate::descriptors;
use crate::environment;
use crate::exit::Failure;
use crate::shutdown::{self, Shutdown, ShutdownFlags};
use crate::supervision::scheduling;

/// How long tasks may take to end when the process does.
const ENDING: Duration = Duration::from_millis(500);

/// Runs a process until it ends; SIGTERM, SIGINT and what the flags say ask it to, and so does a panic of any thread,
/// those of libraries included: whoever supervises the process starts it again.
///
/// # Errors
/// What the process ends with, or what in it has failed; or there is no runtime.
pub fn until_done<F>(
    flags: ShutdownFlags,
    process: impl FnOnce(Shutdown) -> F,
) -> Result<(), Failure>
where
    F: Future<Output = Result<(), Failure>>,
{
    descriptors::ask_for_more();
    scheduling::log();
    environment::log();
    // Zenoh needs more than one worker thread.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::running("the runtime cannot be started", error))?;
    let outcome = runtime.block_on(async {
        let shutdown = shutdown::on_request(flags)
            .map_err(|error| Failure::running("requests to end cannot be received", error))?;
        end_on_panic(shutdown.clone());
        let witness = shutdown.clone();
        process(shutdown).await?;
        witness.failure().map_or(Ok(()), |reason| Err(Failure::Running(reason)))
    });
    // A task that never yields, like a session that waits for its router, must not keep the process.
    runtime.shutdown_timeout(ENDING);
    outcome
}

fn end_on_panic(shutdown: Shutdown) {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        report(panic);
        let thread = std::thread::current();
        let name = thread.name().unwrap_or("without a name");
        shutdown.fail(format!("the thread `{name}` has panicked"));
    }));
}
