//! `trusswatch demo`: runs a plant and its diagnosers on this machine, injects faults, and reports their diagnosis.
//!
//! One file per stage: `story` defines the faults, `setup` writes the configurations, `children` runs the processes,
//! `course` converts observations to events and compares injected with diagnosed faults, `report` prints the events.

mod children;
mod course;
mod report;
mod setup;

mod story;

use std::fmt::Display;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

use daemon::config::Speed;
use session::client::Live;
use tokio::time::{Instant, sleep_until, timeout_at};
use vocabulary::keys::PLANT;
use vocabulary::{Key, PlantTopic};
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

use crate::failure::Failure;
use crate::link;
use children::{Children, Interrupts};
use course::DemoCourse;
use report::{DemoEvent, Printer};
use setup::DemoSetup;

/// Timeout for the processes to appear.
const APPEAR_WITHIN: Duration = Duration::from_secs(20);
/// Timeout for the plant to advance.
const MOVE_WITHIN: Duration = Duration::from_secs(20);
/// How long to wait for late messages at the end.
const STRAGGLERS: Duration = Duration::from_millis(400);

const EXAMPLES: &str = "\
Examples:
  trusswatch demo
  trusswatch demo bridge --speed max";

/// Run a plant and its diagnosers on this machine, inject faults and watch them being diagnosed
///
/// Starts `trusswatch-plant` and a `trusswatch-diagnoser` for each module, which must lie beside this
/// program, and connects them over free ports of this machine. Ends with a table of injected against
/// diagnosed faults; the exit code is 0 only if every injected fault was named and nothing else was.
/// Ctrl-C stops everything; the exit code is then 130.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Directory of a plant and its modules, as `trusswatch new` makes it [default: the shipped tower]
    directory: Option<PathBuf>,
    /// Print one JSON object a line; the last has the event `summary`
    #[arg(long)]
    json: bool,
    /// How fast the plant runs: `real`, `max` or a factor
    #[arg(long, default_value = "real", value_name = "real|max|FACTOR")]
    speed: Speed,
    /// Seed of the plant's randomness: wind, loads, noise
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// Keep the processes' configurations and logs, and print where they are
    #[arg(long)]
    keep_logs: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    link::block_on(stage(arguments))
}

/// Sets up, runs the demo, and always cleans up.
async fn stage(arguments: &Arguments) -> Result<(), Failure> {
    let mut interrupts = Interrupts::listen()?;
    let setup = DemoSetup::set_up(arguments.directory.as_deref(), arguments.speed, arguments.seed)?;
    let mut children = Children::default();
    let started = setup.start_diagnosers(&mut children);
    let shown = match started {
        Ok(()) => tokio::select! {
            shown = connect_and_show(arguments, &setup, &mut children) => shown,
            () = interrupts.next() => Err(Failure::interrupted("interrupted before the end")),
        },
        Err(failure) => Err(failure),
    };
    children.stop(&mut interrupts).await;
    if let Some(kept) = setup.clear_away(arguments.keep_logs) {
        // Standard error may be closed.
        let _ = writeln!(io::stderr(), "logs and configurations are in {}", kept.display());
    }
    shown
}

async fn connect_and_show(
    arguments: &Arguments,
    setup: &DemoSetup,
    children: &mut Children,
) -> Result<(), Failure> {
    // The parent listens for monitoring clients, and connects to the processes when they appear.
    let network = session::Network {
        listen: vec![setup.own.clone()],
        ..session::Network::peer_of(&setup.endpoints)
    };
    let session = session::open(&network).await.map_err(network_failure)?;
    // Before any process runs, so that no message is missed.
    let structure = &setup.structure;
    let mut live = Live::over(&session, Some(structure.clone()), setup.modules.clone()).await?;
    let status = Key::of_plant(structure, PlantTopic::Status).to_string();
    let statuses = session.declare_subscriber(status).await.map_err(network_failure)?;
    let (timing, acts) = (setup.timing, setup.acts.clone());
    let mut course = DemoCourse::new(timing, acts, &setup.modules, setup.components);
    let early = diagnosers(&mut course, &mut live, children).await?;
    setup.start_plant(children)?;
    let mut printer = Printer::new(arguments.json, timing.step_s);
    let processes = children.processes();
    let pids = processes.iter().map(|process| process.pid).collect();
    let (structure, endpoint) = (structure.to_string(), setup.own.clone());
    printer.print(&DemoEvent::Started { structure, processes, endpoint })?;
    for event in early {
        printer.print(&event)?;
    }
    let shown = tokio::select! {
        shown = listen(&mut course, &mut live, &statuses, &mut printer) => shown,
        failure = children.unexpected_end() => Err(failure),
    };
    drop(statuses);
    session::close(&session).await;
    shown?;
    let summary = course.summary(pids);
    let exact = summary.exact;
    printer.print(&DemoEvent::Summary(summary))?;
    if exact { Ok(()) } else { Err(Failure::reported()) }
}

/// Waits until every diagnoser is connected, so that no message of it is missed: a plant started earlier could inject
/// the first fault before that. Returns the events that arrived meanwhile and are to be reported.
async fn diagnosers(
    course: &mut DemoCourse,
    live: &mut Live,
    children: &mut Children,
) -> Result<Vec<DemoEvent>, Failure> {
    let mut early = Vec::new();
    let deadline = Instant::now() + APPEAR_WITHIN;
    loop {
        let missing: Vec<&str> =
            course.missing().iter().map(String::as_str).filter(|name| *name != PLANT).collect();
        if missing.is_empty() {
            return Ok(early);
        }
        let event = tokio::select! {
            event = live.next_event() => event.ok_or_else(closed)?,
            failure = children.unexpected_end() => return Err(failure),
            () = sleep_until(deadline) => return Err(still_waiting(&missing.join(", "))),
        };
        course.on_event(&event, &mut early);
    }
}

/// Prints observed events until the demo ends.
async fn listen(
    course: &mut DemoCourse,
    live: &mut Live,
    statuses: &Subscriber<FifoChannelHandler<Sample>>,
    printer: &mut Printer,
) -> Result<(), Failure> {
    let mut scenes = live.scenes();
    // The deadline for processes to appear or the plant to advance.
    let (mut deadline, mut seen) = (Instant::now() + APPEAR_WITHIN, None);
    let mut end = None;
    loop {
        let mut events = Vec::new();
        let observed = timeout_at(end.unwrap_or(deadline), async {
            tokio::select! {
                event = live.next_event() => {
                    course.on_event(&*event.ok_or_else(closed)?, &mut events);
                }
                changed = scenes.changed() => {
                    changed.map_err(|_| closed())?;
                    course.on_scene(&scenes.borrow_and_update(), &mut events);
                }
                status = statuses.recv_async() => {
                    let status = status.map_err(|_| closed())?;
                    // An unreadable status is ignored.
                    if let Ok(status) = vocabulary::decode(&status.payload().to_bytes()) {
                        course.on_plant(&status, &mut events);
                    }
                }
            }
            Ok::<_, Failure>(())
        });
        match observed.await {
            Ok(observed) => observed?,
            Err(_) if end.is_some() => return Ok(()),
            Err(_) => return Err(stalled(course)),
        }
        let now = Some((course.missing().len(), course.now()));
        if now != seen {
            (deadline, seen) = (Instant::now() + MOVE_WITHIN, now);
        }
        if course.has_ended() {
            end.get_or_insert_with(|| Instant::now() + STRAGGLERS);
        }
        for event in events {
            printer.print(&event)?;
        }
    }
}

fn stalled(course: &DemoCourse) -> Failure {
    let (missing, seconds) = (course.missing().join(", "), MOVE_WITHIN.as_secs());
    if missing.is_empty() {
        let step = course.now();
        return Failure::runtime(format!("no progress beyond step {step} for {seconds} s"));
    }
    still_waiting(&missing)
}

fn still_waiting(missing: &str) -> Failure {
    let seconds = MOVE_WITHIN.as_secs();
    Failure::network(format!("still waiting for {missing} after {seconds} s"))
}

fn closed() -> Failure {
    Failure::network("the session was closed")
}

fn network_failure(error: impl Display) -> Failure {
    Failure::network(error.to_string())
}
