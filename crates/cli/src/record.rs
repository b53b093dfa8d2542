//! `trusswatch record`: records published messages as MCAP files, and repairs damaged files.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use daemon::recorder::{self, RecordedKeys, RecorderConfig, RecorderReport};
use indicatif::ProgressBar;
use recording::{FileLimits, RecordingError, Recovered};
use serde_json::{Value, json};
use shell::shutdown::ShutdownFlags;
use shell::{logging, runtime};
use vocabulary::ModuleName;

use crate::failure::Failure;
use crate::link::Link;
use crate::output;
use crate::table::{table, terminal_width};

/// Interval of log lines without a terminal.
const LINE_EVERY: Duration = Duration::from_secs(60);
const MIB: u64 = 1 << 20;
const MINUTE_NS: u64 = 60_000_000_000;

/// Record what is published, as MCAP files, until interrupted
///
/// Every message is kept as it was published, with its schema, for `trusswatch replay` and for any viewer of MCAP
/// files; of a block of samples, each step by itself. Not recorded are corrected readings, which follow from the samples
/// (`--key` records them too). What a module's diagnoser was set up with is in the file and, at its head, its state, so that each file can
/// be replayed by itself. Missed messages are fetched from their publisher;
/// those that cannot be fetched are counted, in the file too. A new file begins by size and time, the oldest are
/// deleted by quota. Killed at any moment, it loses a second at most; `--recover` makes a finished file of an unfinished
/// or damaged one.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Only this module; may be repeated
    #[arg(long = "module", value_name = "NAME")]
    modules: Vec<ModuleName>,
    /// Only what is published on this key expression; may be repeated, also beside modules
    #[arg(long = "key", value_name = "EXPRESSION")]
    keys: Vec<String>,
    /// The directory of the files
    #[arg(long, value_name = "DIRECTORY", default_value = "recordings")]
    into: PathBuf,
    /// Begin another file after this size [MiB]
    #[arg(long, value_name = "MIB", default_value = "256", value_parser = clap::value_parser!(u64).range(1..=1 << 20))]
    max_file_mib: u64,
    /// Begin another file after this time [min]
    #[arg(long, value_name = "MINUTES", default_value = "60", value_parser = clap::value_parser!(u64).range(1..=10_080))]
    max_file_minutes: u64,
    /// Delete the oldest recordings of this name beyond this size of all [MiB]
    #[arg(long, value_name = "MIB", default_value = "4096", value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    quota_mib: u64,
    /// Make a finished file of this one, of any program that writes MCAP, and end
    #[arg(long, value_name = "FILE")]
    recover: Option<PathBuf>,
    /// Where the finished file goes; otherwise beside it, as `NAME.recovered.mcap`
    #[arg(long, value_name = "FILE", requires = "recover")]
    to: Option<PathBuf>,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    shutdown: ShutdownFlags,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.recover {
        Some(file) => recover(arguments, file),
        None => record(arguments),
    }
}

fn record(arguments: &Arguments) -> Result<(), Failure> {
    logging::start();
    let target = arguments.link.target()?;
    let (modules, keys) = (arguments.modules.clone(), arguments.keys.clone());
    let config = RecorderConfig {
        network: target.network().clone(),
        keys: RecordedKeys { structure: target.structure.clone(), modules, keys },
        directory: arguments.into.clone(),
        limits: FileLimits {
            file_bytes: arguments.max_file_mib * MIB,
            file_ns: arguments.max_file_minutes * MINUTE_NS,
            quota_bytes: arguments.quota_mib * MIB,
        },
    };
    let mut last = RecorderReport::default();
    let mut line = ProgressLine::new();
    let (into, shows) = (&mut last, &mut line);
    let outcome = runtime::until_done(arguments.shutdown, |shutdown| async move {
        *into = recorder::run(config, shutdown, |report| shows.report(report)).await?;
        Ok(())
    });
    line.bar.finish_and_clear();
    outcome?;
    output::print(&if arguments.json { output::text(&document(&last))? } else { text(&last) })
}

fn recover(arguments: &Arguments, from: &Path) -> Result<(), Failure> {
    let to = arguments.to.clone().unwrap_or_else(|| from.with_extension("recovered.mcap"));
    let recovered = recording::recover(from, &to).map_err(|error| match error {
        error @ RecordingError::Read { .. } => Failure::input(error.to_string()),
        error @ RecordingError::Write { .. } => Failure::runtime(error.to_string()),
    })?;
    let Recovered { messages, problems, ending } = &recovered;
    output::print(&if arguments.json {
        output::text(&json!({
            "from": from,
            "to": to,
            "messages": messages,
            "ending": ending.to_string(),
            "problems": problems,
        }))?
    } else {
        let problems: String = problems.iter().map(|problem| format!("  {problem}\n")).collect();
        let (from, to) = (from.display(), to.display());
        format!("{from}: {ending}\n{problems}{to}: {messages} messages\n")
    })?;
    match messages {
        0 => Err(Failure::input(format!("{}: no message could be recovered", from.display()))),
        _ => Ok(()),
    }
}

/// The JSON document of the summary.
fn document(report: &RecorderReport) -> Value {
    json!({
        "files": report.files,
        "recorded": report.total(),
        "fetched": report.fetched,
        "lost": report.lost(),
        "messages": report.messages,
        "losses": report.losses,
    })
}

/// The summary in readable form.
fn text(report: &RecorderReport) -> String {
    let mut table = table(&["topic", "messages", "lost"]);
    table.align_right([1, 2]);
    let topics = report.messages.keys().chain(report.losses.keys());
    let topics: BTreeSet<&String> = topics.collect();
    for topic in topics {
        let count = |of: &BTreeMap<String, u64>| of.get(topic).copied().unwrap_or(0).to_string();
        table.add_row([topic.clone(), count(&report.messages), count(&report.losses)]);
    }
    let mut text = table.text(terminal_width());
    for file in &report.files {
        let _ = writeln!(text, "{}", file.display());
    }
    let (recorded, fetched, lost) = (report.total(), report.fetched, report.lost());
    let _ = writeln!(text, "{recorded} messages recorded, {fetched} of them fetched; {lost} lost");
    text
}

/// A line that is updated on a terminal; elsewhere a log line each minute.
struct ProgressLine {
    bar: ProgressBar,
    is_terminal: bool,
    logged: Instant,
}

impl ProgressLine {
    fn new() -> Self {
        let is_terminal = io::stderr().is_terminal();
        let bar = if is_terminal { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        Self { bar, is_terminal, logged: Instant::now() }
    }

    fn report(&mut self, report: &RecorderReport) {
        if self.is_terminal {
            self.bar.set_message(report.line());
            self.bar.tick();
        } else if self.logged.elapsed() >= LINE_EVERY {
            tracing::info!("{}", report.line());
            self.logged = Instant::now();
        }
    }
}
