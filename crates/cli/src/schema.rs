//! `trusswatch schema`: the message schemas, for programs of third parties.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use serde_json::{Map, Value};
use vocabulary::{
    MAX_MESSAGE_BYTES,
    catalogue::{Entry, Travels, catalogue},
};

use crate::failure::Failure;
use crate::output;
use crate::table::{table, terminal_width};

/// Print the JSON Schema of messages, for programs of your own
///
/// Without a message: the schemas of all, as one object.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Only this message, e.g. `sample`
    #[arg(value_name = "MESSAGE", value_parser = known(), conflicts_with = "list")]
    message: Option<String>,
    /// List the messages and their keys instead
    #[arg(long)]
    list: bool,
    /// Print an example of the message instead
    #[arg(long, requires = "message", conflicts_with = "check")]
    example: bool,
    /// Read messages from this file, one on each line (`-` for standard input), and report which ones
    /// would be refused, and why
    #[arg(long, requires = "message", value_name = "FILE")]
    check: Option<PathBuf>,
}

/// The names of the messages.
fn known() -> clap::builder::PossibleValuesParser {
    catalogue().map(|entry| entry.name).into()
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut entries = catalogue().into_iter();
    let wanted = arguments.message.as_ref();
    match wanted.and_then(|name| entries.find(|entry| entry.name == name)) {
        Some(entry) => one(&entry, arguments),
        None if arguments.list => list(),
        None => print(&all()),
    }
}

fn one(entry: &Entry, arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.check {
        Some(file) => check(entry, file),
        None if arguments.example => Ok(output::stdout().write_all(entry.example().as_bytes())?),
        None => print(&entry.schema()),
    }
}

fn all() -> Value {
    catalogue()
        .iter()
        .map(|entry| (entry.name.to_owned(), entry.schema()))
        .collect::<Map<_, _>>()
        .into()
}

fn print(value: &Value) -> Result<(), Failure> {
    let mut out = output::stdout();
    serde_json::to_writer_pretty(&mut out, value)?;
    Ok(writeln!(out)?)
}

fn list() -> Result<(), Failure> {
    let mut table = table(&["message", "travels as", "on trusswatch/{structure}/…"]);
    for entry in catalogue() {
        let mut name = entry.name;
        for travels in [Travels::Published, Travels::Querying, Travels::Replying, Travels::Refusing]
        {
            let keys = entry.travels.iter().filter(|(_, how)| *how == travels).map(|(key, _)| *key);
            for (index, key) in keys.enumerate() {
                table.add_row([name, if index == 0 { travels.as_str() } else { "" }, key]);
                name = "";
            }
        }
    }
    Ok(writeln!(output::stdout(), "{}", table.text(terminal_width()))?)
}

/// Checks each line for being a valid message.
fn check(entry: &Entry, file: &Path) -> Result<(), Failure> {
    let mut lines = open(file)?;
    let (mut count, mut refused) = (0_u64, Vec::new());
    while let Some(line) = next(&mut lines, file)? {
        count += 1;
        if let Err(error) = entry.check(&line) {
            refused.push(format!("{}:{count}: {error}", file.display()));
        }
    }
    if refused.is_empty() {
        writeln!(output::stdout(), "{}: valid: {count} × {}", file.display(), entry.name)?;
        return Ok(());
    }
    Err(Failure::inputs(refused))
}

fn open(file: &Path) -> Result<Box<dyn BufRead>, Failure> {
    if file == Path::new("-") {
        return Ok(Box::new(io::stdin().lock()));
    }
    let opened = File::open(file).map_err(|error| Failure::unreadable(file, error))?;
    Ok(Box::new(BufReader::new(opened)))
}

/// The next line without its end. A line too long for a message is truncated to a length that shows this.
fn next(lines: &mut impl BufRead, file: &Path) -> Result<Option<Vec<u8>>, Failure> {
    let failed = |error: io::Error| Failure::unreadable(file, error);
    let mut line = Vec::new();
    let enough = MAX_MESSAGE_BYTES as u64 + 1;
    if lines.by_ref().take(enough).read_until(b'\n', &mut line).map_err(failed)? == 0 {
        return Ok(None);
    }
    if line.last() == Some(&b'\n') {
        line.pop();
    } else {
        lines.skip_until(b'\n').map_err(failed)?;
    }
    Ok(Some(line))
}
