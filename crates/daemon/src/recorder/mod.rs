//! The process that records what is published.
//!
//! | file | job |
//! |---|---|
//! | `subject` | what is to be recorded, as key expressions |
//! | `inlet` | takes messages from the network, never waits |
//! | `continuity` | what is missing between those that came |
//! | `fetching` | asks for it, and for what was before the recorder |
//! | `attendance` | whose configuration, inputs and present states are asked for |
//! | `pen` | a thread: writes everything |
//! | `report` | how far it has come |

mod attendance;
mod continuity;
mod fetching;
mod inlet;
mod pen;
mod report;
mod subject;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use recording::{FileLimits, RecordingFiles};
use session::Network;
use tokio::sync::mpsc;
use zenoh::Session;
use zenoh::pubsub::Subscriber;

pub use report::Report;
pub use subject::Subject;

use attendance::Attendance;
use fetching::Fetcher;
use inlet::Inlet;
use pen::Pen;
use report::Board;
use shell::exit::Failure;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::{Crew, OPENING, Supervisor};

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
    pub subject: Subject,
    /// The directory of the files.
    pub directory: PathBuf,
    /// How long they become.
    pub limits: FileLimits,
}

/// Records until it is asked to end; `show` is given the report now and then. Returns the last one.
///
/// # Errors
/// No session, no directory, or the network refuses a declaration.
pub async fn run(
    config: RecorderConfig,
    mut shutdown: Shutdown,
    show: impl FnMut(&Report),
) -> Result<Report, Failure> {
    std::fs::create_dir_all(&config.directory).map_err(|error| {
        Failure::running(&format!("directory {}", config.directory.display()), error)
    })?;
    let supervisor = Supervisor::from_environment();
    supervisor.status(OPENING);
    let Some(session) = open_unless(&config.network, &mut shutdown).await? else {
        return Ok(Report::default());
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
    mut show: impl FnMut(&Report),
) -> Result<Report, Failure> {
    let refused =
        |error: zenoh::Error| Failure::running("the network refuses a declaration", error);
    let crew = Crew::new(shutdown.clone(), supervisor.pulse());
    let board = Arc::new(Board::default());
    let (inlet, arrivals) = Inlet::new(ROOM);
    let (fetcher, questions) = Fetcher::new(session, inlet.clone());
    let outstanding = questions.clone();
    let files = RecordingFiles::new(&config.directory, config.subject.name(), config.limits);
    let pen = Pen::new(files, &config.subject, Arc::clone(&board), inlet.dropped(), questions);
    let written = crew.thread("pen", move |_| pen.run(arrivals));
    let written = written.map_err(|error| Failure::running("no thread can be started", error))?;
    let subscribers = subscribe(session, &config.subject, &inlet).await.map_err(refused)?;
    let attendance = Attendance::watch(session, &config.subject, fetcher.desk());
    let attendance = attendance.await.map_err(refused)?;
    let tasks =
        [crew.task("fetching", fetcher.run()), crew.task("ticking", inlet::tick(inlet.clone()))];
    drop(inlet);
    tracing::info!(directory = %config.directory.display(), keys = ?config.subject.expressions(), "ready");
    supervisor.ready("recording");
    while !shutdown.is_requested() {
        let report = board.read();
        supervisor.status(&report.line());
        supervisor.progress();
        show(&report);
        tokio::select! {
            () = shutdown.requested() => {}
            () = tokio::time::sleep(EVERY) => {}
        }
    }
    supervisor.stopping();
    for subscriber in subscribers.into_iter().chain([attendance]) {
        subscriber.undeclare().await.map_err(refused)?;
    }
    // What is still missing is counted as lost.
    let _ = tokio::time::timeout(DRAINING, outstanding.fulfilled()).await;
    tasks.iter().for_each(tokio::task::AbortHandle::abort);
    drop(outstanding);
    if tokio::time::timeout(DRAINING, written).await.is_err() {
        tracing::warn!("the last messages did not get onto the disk within {DRAINING:?}");
    }
    let report = board.read();
    tracing::info!("stopped: {}", report.line());
    Ok(report)
}

async fn subscribe(
    session: &Session,
    subject: &Subject,
    inlet: &Inlet,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let mut subscribers = Vec::new();
    for expression in subject.distinct()? {
        let inlet = inlet.clone();
        let earlier = expression.overlapped;
        let subscriber = session.declare_subscriber(expression.whole).callback(move |sample| {
            if !earlier.iter().any(|earlier| earlier.intersects(sample.key_expr())) {
                inlet.take(&sample);
            }
        });
        subscribers.push(subscriber.await?);
    }
    Ok(subscribers)
}

/// A queue between the network and the pen.
type Sender<T> = mpsc::Sender<T>;
