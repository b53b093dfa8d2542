//! The process that records what is published.
//!
//! | file | job |
//! |---|---|
//! | `keys` | what is to be recorded, as key expressions |
//! | `queue` | takes messages from the network, never waits |
//! | `missing` | what is missing between those that came |
//! | `fetching` | asks for it, for what was before the recorder, and for each diagnoser's configuration, present states and whole state |
//! | `states` | which diagnosers owe the present file their state |
//! | `writer` | a thread: writes everything |
//! | `report` | how far it has come |

mod fetching;
mod keys;
mod missing;
mod queue;
mod report;
mod states;
mod writer;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use parking_lot::Mutex;
use recording::{FileLimits, RecordingFiles};
use session::Network;
use zenoh::Session;
use zenoh::pubsub::Subscriber;

pub use keys::RecordedKeys;
pub use report::RecorderReport;

use fetching::{FetchRequests, Fetcher, watch_diagnosers};
use queue::EventQueue;
use shell::exit::Failure;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::{Crew, OPENING, Supervisor};
use writer::RecordingThread;

/// Messages that may wait to be written.
const ROOM: usize = 16_384;
/// From one look at the report to the next; each is a watchdog heartbeat.
const EVERY: Duration = Duration::from_millis(250);
/// How long the last messages may take to get onto the disk.
const DRAINING: Duration = Duration::from_secs(3);

/// What is recorded, and where to.
#[derive(Debug, Clone)]
pub struct RecorderConfig {
    /// The place on the network.
    pub network: Network,
    /// What is to be recorded.
    pub keys: RecordedKeys,
    /// The directory of the files.
    pub directory: PathBuf,
    /// How long they become.
    pub limits: FileLimits,
}

/// Records until it is asked to end; `show` is given the report now and then. Returns the last one.
///
/// # Errors
/// No session, no directory, or a Zenoh declaration fails.
pub async fn run(
    config: RecorderConfig,
    mut shutdown: Shutdown,
    show: impl FnMut(&RecorderReport),
) -> Result<RecorderReport, Failure> {
    std::fs::create_dir_all(&config.directory).map_err(|error| {
        Failure::running(&format!("directory {}", config.directory.display()), error)
    })?;
    let supervisor = Supervisor::from_environment();
    supervisor.status(OPENING);
    let Some(session) = open_unless(&config.network, &mut shutdown).await? else {
        return Ok(RecorderReport::default());
    };
    let result = record(&session, &config, supervisor, shutdown, show).await;
    session::close(&session).await;
    result
}

async fn record(
    session: &Session,
    config: &RecorderConfig,
    supervisor: Supervisor,
    mut shutdown: Shutdown,
    mut show: impl FnMut(&RecorderReport),
) -> Result<RecorderReport, Failure> {
    let refused = |error: zenoh::Error| Failure::running("Zenoh declaration failed", error);
    let crew = Crew::new(shutdown.clone(), supervisor.pulse());
    let report = Arc::<Mutex<RecorderReport>>::default();
    let (queue, events) = EventQueue::new(ROOM);
    let (requests, queued_requests) = FetchRequests::new();
    let files = RecordingFiles::new(&config.directory, config.keys.name(), config.limits);
    let writer = RecordingThread::new(
        files,
        &config.keys,
        Arc::clone(&report),
        queue.dropped(),
        requests.clone(),
    );
    let written = crew.thread("recording", move |_| writer.run(events));
    let written = written.map_err(|error| Failure::running("no thread can be started", error))?;
    let subscribers = subscribe(session, &config.keys, &queue).await.map_err(refused)?;
    let diagnosers = watch_diagnosers(session, &config.keys, requests.clone());
    let diagnosers = diagnosers.await.map_err(refused)?;
    let fetching = Fetcher::new(session, queue.clone()).run(requests.clone(), queued_requests);
    let tasks = [crew.task("fetching", fetching), crew.task("ticking", queue::tick(queue.clone()))];
    drop(queue);
    tracing::info!(directory = %config.directory.display(), keys = ?config.keys.expressions(), "ready");
    supervisor.ready("recording");
    while !shutdown.is_requested() {
        let present = report.lock().clone();
        supervisor.status(&present.line());
        supervisor.progress();
        show(&present);
        tokio::select! {
            () = shutdown.requested() => {}
            () = tokio::time::sleep(EVERY) => {}
        }
    }
    supervisor.stopping();
    for subscriber in subscribers.into_iter().chain([diagnosers]) {
        subscriber.undeclare().await.map_err(refused)?;
    }
    // What is still missing is counted as lost.
    let _ = tokio::time::timeout(DRAINING, requests.fulfilled()).await;
    tasks.iter().for_each(tokio::task::AbortHandle::abort);
    drop(requests);
    if tokio::time::timeout(DRAINING, written).await.is_err() {
        tracing::warn!("shutdown timed out after {DRAINING:?} before all messages were written");
    }
    let report = report.lock().clone();
    tracing::info!("stopped: {}", report.line());
    Ok(report)
}

async fn subscribe(
    session: &Session,
    keys: &RecordedKeys,
    queue: &EventQueue,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let mut subscribers = Vec::new();
    for (expression, earlier) in keys.distinct()? {
        let queue = queue.clone();
        let subscriber = session.declare_subscriber(expression).callback(move |sample| {
            if !earlier.iter().any(|earlier| earlier.intersects(sample.key_expr())) {
                queue.take(&sample);
            }
        });
        subscribers.push(subscriber.await?);
    }
    Ok(subscribers)
}
