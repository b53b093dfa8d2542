//! `trusswatch demo`: a plant and its diagnosers on this machine, faults, and what becomes of them.
//!
//! One stage a file: `rig` lays out the configurations, `children` runs the processes, `network`
//! listens to them, `show` turns what is heard into entries, `voice` tells them, `ledger` compares
//! what was injected with what was diagnosed.

mod binaries;
mod children;
mod entry;
mod interrupt;
mod ledger;
mod network;
mod news;
mod rig;
mod show;
mod story;
#[cfg(test)]
mod testing;
mod voice;

use std::io::{self, Write};
use std::time::Duration;

use daemon::config::Speed;
use tokio::time::{Instant, sleep_until, timeout_at};
use truss::ids::Step;

use crate::failure::Failure;
use children::Children;
use entry::Entry;
use interrupt::Interrupts;
use network::Network;
use rig::Rig;
use show::Show;
use voice::Voice;

/// How long the processes may take to appear.
const APPEAR_WITHIN: Duration = Duration::from_secs(20);
/// How long the plant may stand still.
const MOVE_WITHIN: Duration = Duration::from_secs(20);
/// How long after the end news may still be on its way.
const STRAGGLERS: Duration = Duration::from_millis(400);

/// Run a plant and its diagnosers on this machine, inject faults and watch them being diagnosed
///
/// Starts `trusswatch-plant` and a `trusswatch-diagnoser` for each module, which must lie beside this
/// program, and lets them talk over free ports of this machine. Ends with a table of injected against
/// diagnosed faults; the exit code is 0 only if every injected fault was named and nothing else was.
/// Ctrl-C stops everything.
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
    /// Keep the processes' configurations and logs, and say where they are
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
    let started = rig.start(&mut children);
    let shown = match started {
        Ok(()) => tokio::select! {
            shown = connect_and_show(arguments, &rig, &mut children) => shown,
            () = interrupts.next() => Err(Failure::runtime("interrupted before the end")),
        },
        Err(failure) => Err(failure),
    };
    children.stop(&mut interrupts).await;
    if let Some(kept) = rig.clear_away(arguments.keep_logs) {
        // Nobody is left to be told if standard error is closed.
        let _ = writeln!(io::stderr(), "logs and configurations are in {}", kept.display());
    }
    shown
}

async fn connect_and_show(
    arguments: &Arguments,
    rig: &Rig,
    children: &mut Children,
) -> Result<(), Failure> {
    let mut network = Network::open(&rig.structure, &rig.own, &rig.endpoints).await?;
    let mut voice = Voice::new(arguments.json, rig.pace.step_s);
    let processes = children.processes();
    let pids = processes.iter().map(|process| process.pid).collect();
    let (structure, endpoint) = (rig.structure.to_string(), rig.own.clone());
    voice.tell(&Entry::Started { structure, processes, endpoint })?;
    let mut show = Show::new(rig.pace, rig.acts.clone(), &rig.modules);
    let shown = tokio::select! {
        shown = listen(&mut show, &mut network, &mut voice) => shown,
        failure = children.a_death() => Err(failure),
    };
    network.close().await;
    shown?;
    let summary = show.summary(pids);
    let exact = summary.exact;
    voice.tell(&Entry::Summary(summary))?;
    if exact { Ok(()) } else { Err(Failure::told()) }
}

/// Tells what is heard until the show is over.
async fn listen(show: &mut Show, network: &mut Network, voice: &mut Voice) -> Result<(), Failure> {
    let mut entries = Vec::new();
    let mut patience = Patience::new();
    while !show.is_over() {
        let news = tokio::select! {
            news = network.next() => news?,
            () = sleep_until(patience.until) => return Err(patience.lost(show)),
        };
        show.take(news, &mut entries);
        patience.look_at(show);
        for entry in entries.drain(..) {
            voice.tell(&entry)?;
        }
    }
    let end = Instant::now() + STRAGGLERS;
    while let Ok(news) = timeout_at(end, network.next()).await {
        show.take(news?, &mut entries);
        for entry in entries.drain(..) {
            voice.tell(&entry)?;
        }
    }
    Ok(())
}

/// Waits for things to appear and to move, but not for ever.
struct Patience {
    until: Instant,
    seen: (usize, Step),
}

impl Patience {
    fn new() -> Patience {
        Patience { until: Instant::now() + APPEAR_WITHIN, seen: (usize::MAX, Step(0)) }
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
            let missing = missing.join(", ");
            Failure::network(format!("still waiting for {missing} after {seconds} s"))
        }
    }
}
