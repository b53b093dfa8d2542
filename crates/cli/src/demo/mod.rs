//! `trusswatch demo`: a plant and its diagnosers on this machine, faults, and what becomes of them.
//!
//! One stage a file: `story` says which faults, `rig` lays out the configurations, `children` runs the processes, `show`
//! turns what is observed into entries and compares what was injected with what was diagnosed, `report` prints them.

mod children;
mod report;
mod rig;
mod show;
mod story;

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::sync::Arc;
use std::time::Duration;

use daemon::config::Speed;
use observer::{Live, News, ObservedEvent};
use tokio::time::{Instant, sleep_until, timeout_at};
use vocabulary::Step;

use crate::failure::Failure;
use children::{Children, Interrupts};
use report::{Entry, Printer};
use rig::Rig;
use show::Show;

/// How long the processes may take to appear.
const APPEAR_WITHIN: Duration = Duration::from_secs(20);
/// How long the plant may stand still.
const MOVE_WITHIN: Duration = Duration::from_secs(20);
/// How long after the end messages may still arrive.
const STRAGGLERS: Duration = Duration::from_millis(400);

/// Run a plant and its diagnosers on this machine, inject faults and watch them being diagnosed
///
/// Starts `trusswatch-plant` and a `trusswatch-diagnoser` for each module, which must lie beside this
/// program, and connects them over free ports of this machine. Ends with a table of injected against
/// diagnosed faults; the exit code is 0 only if every injected fault was named and nothing else was.
/// Ctrl-C stops everything; the exit code is then 130.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
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
    // Zenoh needs more than one worker thread.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::runtime(format!("cannot start the runtime: {error}")))?;
    runtime.block_on(stage(arguments))
}

/// Sets everything up, lets the show run, and clears everything away whatever happened.
async fn stage(arguments: &Arguments) -> Result<(), Failure> {
    let mut interrupts = Interrupts::listen()?;
    let rig = Rig::set_up(arguments.speed, arguments.seed)?;
    let mut children = Children::default();
    let started = rig.start_diagnosers(&mut children);
    let shown = match started {
        Ok(()) => tokio::select! {
            shown = connect_and_show(arguments, &rig, &mut children) => shown,
            () = interrupts.next() => Err(Failure::interrupted("interrupted before the end")),
        },
        Err(failure) => Err(failure),
    };
    children.stop(&mut interrupts).await;
    if let Some(kept) = rig.clear_away(arguments.keep_logs) {
        // Standard error may be closed.
        let _ = writeln!(io::stderr(), "logs and configurations are in {}", kept.display());
    }
    shown
}

async fn connect_and_show(
    arguments: &Arguments,
    rig: &Rig,
    children: &mut Children,
) -> Result<(), Failure> {
    // The parent listens for monitoring clients, and connects to the processes as they come up.
    let network = session::Network {
        listen: vec![rig.own.clone()],
        ..session::Network::peer_of(&rig.endpoints)
    };
    let session =
        session::open(&network).await.map_err(|error| Failure::network(error.to_string()))?;
    // Before any process runs: nothing is published earlier.
    let live = Live::over(&session, Some(rig.structure.clone()), rig.modules.clone());
    let mut live = live.await.map_err(|error| Failure::network(error.to_string()))?;
    let early = diagnosers(rig, &mut live, children).await?;
    rig.start_plant(children)?;
    let mut printer = Printer::new(arguments.json, rig.pace.step_s);
    let processes = children.processes();
    let pids = processes.iter().map(|process| process.pid).collect();
    let (structure, endpoint) = (rig.structure.to_string(), rig.own.clone());
    printer.print(&Entry::Started { structure, processes, endpoint })?;
    let mut show = Show::new(rig.pace, rig.acts.clone(), &rig.modules, rig.components);
    let mut entries = Vec::new();
    early.iter().for_each(|event| show.on_event(event, &mut entries));
    for entry in entries {
        printer.print(&entry)?;
    }
    let shown = tokio::select! {
        shown = listen(&mut show, &mut live, &mut printer) => shown,
        failure = children.unexpected_end() => Err(failure),
    };
    session::close(&session).await;
    shown?;
    let summary = show.summary(pids);
    let exact = summary.exact;
    printer.print(&Entry::Summary(summary))?;
    if exact { Ok(()) } else { Err(Failure::reported()) }
}

/// Waits until every diagnoser is connected: what it publishes from then on is received. A plant that started before
/// could inject the first fault earlier. Returns what was received meanwhile.
async fn diagnosers(
    rig: &Rig,
    live: &mut Live,
    children: &mut Children,
) -> Result<Vec<Arc<ObservedEvent>>, Failure> {
    let mut missing: BTreeSet<String> = rig.modules.iter().map(ToString::to_string).collect();
    let mut early = Vec::new();
    let deadline = Instant::now() + APPEAR_WITHIN;
    while !missing.is_empty() {
        let event = tokio::select! {
            event = live.next_event() => event.ok_or_else(closed)?,
            failure = children.unexpected_end() => return Err(failure),
            () = sleep_until(deadline) => return Err(still_waiting(missing)),
        };
        if let News::Presence { who, there: true, .. } = &event.news {
            missing.remove(who);
        }
        early.push(event);
    }
    Ok(early)
}

fn still_waiting(missing: impl IntoIterator<Item = String>) -> Failure {
    let missing = missing.into_iter().collect::<Vec<_>>().join(", ");
    let seconds = MOVE_WITHIN.as_secs();
    Failure::network(format!("still waiting for {missing} after {seconds} s"))
}

fn closed() -> Failure {
    Failure::network("the session was closed")
}

/// Prints observed events until the demo ends.
async fn listen(show: &mut Show, live: &mut Live, printer: &mut Printer) -> Result<(), Failure> {
    let mut scenes = live.scenes();
    let mut deadline = Deadline::new();
    let mut end = None;
    loop {
        let mut entries = Vec::new();
        let until = end.unwrap_or(deadline.until);
        let observed = timeout_at(until, async {
            tokio::select! {
                event = live.next_event() => {
                    show.on_event(&*event.ok_or_else(closed)?, &mut entries);
                }
                changed = scenes.changed() => {
                    changed.map_err(|_| closed())?;
                    show.on_scene(&scenes.borrow_and_update(), &mut entries);
                }
            }
            Ok::<_, Failure>(())
        });
        match observed.await {
            Ok(observed) => observed?,
            Err(_) if end.is_some() => return Ok(()),
            Err(_) => return Err(deadline.lost(show)),
        }
        deadline.look_at(show);
        if show.is_over() {
            end.get_or_insert_with(|| Instant::now() + STRAGGLERS);
        }
        for entry in entries {
            printer.print(&entry)?;
        }
    }
}

/// The time by which processes have to appear and the plant to move.
struct Deadline {
    until: Instant,
    seen: (usize, Step),
}

impl Deadline {
    fn new() -> Deadline {
        Deadline { until: Instant::now() + APPEAR_WITHIN, seen: (usize::MAX, Step(0)) }
    }

    fn look_at(&mut self, show: &Show) {
        let seen = (show.missing().len(), show.now());
        if seen != self.seen {
            self.seen = seen;
            self.until = Instant::now() + MOVE_WITHIN;
        }
    }

    fn lost(&self, show: &Show) -> Failure {
        let missing = show.missing();
        let seconds = MOVE_WITHIN.as_secs();
        if missing.is_empty() {
            let step = show.now();
            Failure::runtime(format!("nothing moved beyond step {step} for {seconds} s"))
        } else {
            still_waiting(missing.iter().cloned())
        }
    }
}
