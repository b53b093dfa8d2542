//! `trusswatch record`: what is published, as MCAP files; and damaged files mended.

mod report;

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use daemon::recorder::{self, RecordedKeys, RecorderConfig, RecorderReport};
use indicatif::ProgressBar;
use recording::{FileLimits, RecordingError};
use shell::shutdown::ShutdownFlags;
use shell::{logging, runtime};
use vocabulary::ModuleName;

use crate::failure::Failure;
use crate::link::Link;
use crate::versioned;

/// From one line in the log to the next, where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(60);
const MIB: u64 = 1 << 20;
const MINUTE_NS: u64 = 60_000_000_000;

/// Record what is published, as MCAP files, until interrupted
///
/// Every message is kept as it was published, with its schema, for `trusswatch replay` and for any viewer of MCAP
/// files; what a module's diagnoser was set up with as well. What was missed is fetched from whoever published it; what
/// cannot be had is counted, in the file too. A new file begins by size and time, the oldest are deleted by quota.
/// Killed at any moment, it loses a second at most; `--recover` makes a finished file of an unfinished or damaged one.
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
    let mut show = Show::new();
    let (into, shows) = (&mut last, &mut show);
    let outcome = runtime::until_done(arguments.shutdown, |shutdown| async move {
        *into = recorder::run(config, shutdown, |report| shows.report(report)).await?;
        Ok(())
    });
    show.bar.finish_and_clear();
    outcome?;
    print(arguments, &report::Summary::of(&last), || report::text(&last))
}

fn recover(arguments: &Arguments, from: &Path) -> Result<(), Failure> {
    let to = arguments.to.clone().unwrap_or_else(|| from.with_extension("recovered.mcap"));
    let recovered = recording::recover(from, &to).map_err(|error| match error {
        error @ RecordingError::Read { .. } => Failure::input(error.to_string()),
        error @ RecordingError::Write { .. } => Failure::runtime(error.to_string()),
    })?;
    let document = report::Mended::of(from, &to, &recovered);
    print(arguments, &document, || document.text())
}

fn print<D: serde::Serialize>(
    arguments: &Arguments,
    document: &D,
    text: impl FnOnce() -> String,
) -> Result<(), Failure> {
    let text = if arguments.json { versioned::text(document)? } else { text() };
    Ok(io::stdout().lock().write_all(text.as_bytes())?)
}

/// One line that changes on a terminal; elsewhere one a minute in the log.
struct Show {
    bar: ProgressBar,
    is_terminal: bool,
    logged: Instant,
}

impl Show {
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
