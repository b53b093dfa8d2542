//! `trusswatch simulate`: the whole system on virtual time, driven by seeds.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::Ordering;

use simulation::{SeedResult, SeedSummary, Setup, SimulationError, WorldScenario};
use study::Shard;

use crate::failure::Failure;
use crate::output;
use crate::progress::WorkProgress;
use crate::study::{JobsArguments, stop_on_signal};

/// Simulate the whole system with everything that goes wrong around it: each seed is a world.
///
/// A world has a tower of four modules with their controller, the modules' processes as they run on the module computers,
/// their disks, clocks and network, and careless operators, on virtual time. What must never happen is checked after each
/// event; what must sometimes happen is counted.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
    trusswatch simulate --seeds 0..1000
    trusswatch simulate --seeds 0..100000 --results night.jsonl   (goes on where it was interrupted)
    trusswatch simulate --seeds 0..100000 --shard 1/8 --results part1.jsonl
    trusswatch simulate --merge part0.jsonl part1.jsonl
    trusswatch simulate --show 17 --svg 17.svg

The exit code is 1 if something happened that must never happen.")]
pub(crate) struct Arguments {
    /// Seeds, the second one not included.
    #[arg(long, value_name = "FROM..TO", default_value = "0..100")]
    seeds: SeedRange,
    #[command(flatten)]
    jobs: JobsArguments,
    /// Run only part K of N, counted from 0.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Add each result to this file, and skip the seeds that it has.
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
    /// Summarise these files of results, and run nothing.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["results", "shard", "show"])]
    merge: Vec<PathBuf>,
    /// Print the story of one seed.
    #[arg(long, value_name = "SEED", conflicts_with_all = ["shard", "results"])]
    show: Option<u64>,
    /// Of the story that is shown, leave out what is not needed for something to go wrong.
    #[arg(long, requires = "show")]
    shrink: bool,
    /// Also draw the story that is shown.
    #[arg(long, value_name = "FILE", requires = "show")]
    svg: Option<PathBuf>,
    /// Print the summary as JSON.
    #[arg(long, conflicts_with = "show")]
    json: bool,
}

/// Seeds from the first, without the second.
#[derive(Debug, Clone)]
struct SeedRange(Range<u64>);

impl FromStr for SeedRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parts = text.split_once("..");
        let parsed = parts.and_then(|(from, to)| Some(from.parse().ok()?..to.parse().ok()?));
        parsed
            .filter(|seeds: &Range<u64>| seeds.start < seeds.end)
            .map(Self)
            .ok_or_else(|| "use FROM..TO with FROM below TO, e.g. 0..1000".to_owned())
    }
}

impl From<SimulationError> for Failure {
    fn from(error: SimulationError) -> Self {
        Failure::runtime(error.to_string())
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if !arguments.merge.is_empty() {
        let mut results = BTreeMap::new();
        for file in &arguments.merge {
            results.extend(read(file)?);
        }
        return conclude(&results, arguments.json);
    }
    let jobs = arguments.jobs.count();
    // It takes some seconds; standard error may be closed.
    let _ = writeln!(io::stderr(), "calibrating and commissioning the simulated tower");
    let setup = Setup::tower(jobs)?;
    if let Some(seed) = arguments.show {
        return show(&setup, seed, arguments);
    }
    let (mut file, mut results) = match &arguments.results {
        Some(path) => {
            let results = if path.exists() { read(path)? } else { BTreeMap::new() };
            (Some(open(path)?), results)
        }
        None => (None, BTreeMap::new()),
    };
    results.retain(|seed, _| arguments.seeds.0.contains(seed));
    let missing = simulation::missing(arguments.seeds.0.clone(), arguments.shard, &results);
    let stop = stop_on_signal()?;
    let progress = WorkProgress::new("simulating", "worlds", missing.len() as u64);
    simulation::run_all(&setup, &missing, jobs, &stop, |result| {
        if let Some(file) = &mut file {
            let line = serde_json::to_string(&result)?;
            writeln!(file, "{line}")
                .map_err(|error| Failure::runtime(format!("cannot keep a result: {error}")))?;
        }
        results.insert(result.seed, result);
        progress.advance();
        Ok::<(), Failure>(())
    })?;
    drop(progress);
    let concluded = conclude(&results, arguments.json);
    if stop.load(Ordering::Relaxed) {
        return Err(Failure::interrupted(format!("interrupted after {} worlds", results.len())));
    }
    concluded
}

/// Prints what many seeds gave.
fn conclude(results: &BTreeMap<u64, SeedResult>, json: bool) -> Result<(), Failure> {
    let summary = SeedSummary::of(results);
    if json {
        output::print(&output::text(&summary)?)?;
    } else {
        let mut out = output::stdout();
        for (seed, violations) in &summary.violated {
            for violation in violations {
                writeln!(out, "seed {seed}: {violation}")?;
            }
        }
        if let Some(seed) = summary.violated.keys().next() {
            writeln!(out, "\nThe story: trusswatch simulate --show {seed} --shrink\n")?;
        }
        for what in &summary.unreached {
            writeln!(out, "never happened: {what}")?;
        }
        writeln!(out, "{}", summary.in_words())?;
    }
    if summary.violations > 0 { Err(Failure::reported()) } else { Ok(()) }
}

fn show(setup: &Setup, seed: u64, arguments: &Arguments) -> Result<(), Failure> {
    let mut scenario = WorldScenario::draw(seed, setup);
    if arguments.shrink {
        scenario = simulation::shrink(setup, &scenario)?;
    }
    let outcome = simulation::run(setup, &scenario, true)?;
    let mut out = output::stdout();
    for line in outcome.trace.lines() {
        writeln!(out, "{line}")?;
    }
    for violation in &outcome.violations {
        writeln!(out, "VIOLATION: {violation}")?;
    }
    if let Some(path) = &arguments.svg {
        let picture = simulation::svg(setup, &scenario, &outcome);
        fs::write(path, picture).map_err(|error| Failure::unwritable(path, error))?;
    }
    if outcome.violations.is_empty() { Ok(()) } else { Err(Failure::reported()) }
}

/// Opens a file of results to add to it; what a killed process wrote of a last line is removed.
fn open(path: &Path) -> Result<File, Failure> {
    let unwritable = |error| Failure::unwritable(path, error);
    let text = fs::read(path).unwrap_or_default();
    let whole = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(unwritable)?;
    file.set_len(whole as u64).map_err(unwritable)?;
    Ok(file)
}

/// The results in a file. The last line may be torn; its seed is run again.
fn read(path: &Path) -> Result<BTreeMap<u64, SeedResult>, Failure> {
    let file = File::open(path).map_err(|error| Failure::unreadable(path, error))?;
    let lines = BufReader::new(file).lines().collect::<Result<Vec<String>, _>>();
    let lines = lines.map_err(|error| Failure::unreadable(path, error))?;
    let mut results = BTreeMap::new();
    for (place, line) in lines.iter().enumerate() {
        match serde_json::from_str::<SeedResult>(line) {
            Ok(result) if result.v == 1 => {
                results.insert(result.seed, result);
            }
            Err(_) if place + 1 == lines.len() => {}
            _ => {
                let place = place + 1;
                return Err(Failure::input(format!(
                    "{}:{place}: not a result of `trusswatch simulate`; give another file",
                    path.display()
                )));
            }
        }
    }
    Ok(results)
}
