//! `trusswatch pki list`: who has a certificate, until when, and what is wrong with it.

use std::io::{self, Write};

use pki::{Authority, Certificate, CommonName, Holder};
use serde::Serialize;

use super::{Place, day, refused};
use crate::failure::Failure;
use crate::table::{TextTable, WidthArguments, table};
use crate::versioned;

/// List certificates with their ends; exit code 1 if something is wrong with one
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    place: Place,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    width: WidthArguments,
}

/// All of them for machines.
#[derive(Serialize)]
struct Document<'a> {
    certificates: &'a [Entry],
}

/// A certificate as it is listed.
#[derive(Debug, Serialize)]
struct Entry {
    holder: String,
    addresses: Vec<String>,
    until: Option<String>,
    days_left: Option<i64>,
    problems: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let directory = &arguments.place.directory;
    let authority = Authority::open(directory).map_err(refused)?;
    let holders = arguments.place.library().holders().map_err(|error| {
        Failure::input(format!("{}: cannot be read: {error}", directory.display()))
    })?;
    let entries: Vec<Entry> =
        holders.iter().map(|holder| entry(&arguments.place, &authority, holder)).collect();
    let mut out = io::stdout().lock();
    if arguments.json {
        write!(out, "{}", versioned::text(&Document { certificates: &entries })?)?;
    } else {
        let until = day(authority.certificate().lifetime);
        writeln!(out, "authority of {}, until {until}", authority.structure())?;
        writeln!(out, "{}", in_columns(&entries).text(arguments.width.limit()))?;
    }
    out.flush()?;
    let sound = entries.iter().all(|entry| entry.problems.is_empty());
    if sound { Ok(()) } else { Err(Failure::reported()) }
}

fn entry(place: &Place, authority: &Authority, holder: &Holder) -> Entry {
    let identity = place.library().identity(holder);
    let certificate = Certificate::read(&identity.certificate).ok();
    let expected = CommonName::new(holder.clone(), authority.structure().clone()).ok();
    let mut problems = identity.problems(expected.as_ref(), &[]);
    // The key may have gone to its holder, which is where it belongs.
    if !identity.key.exists() {
        problems.retain(|problem| problem.file != identity.key);
    }
    let left = |read: &Certificate| (read.lifetime.until - pki::lifetime::now()).whole_days();
    let addresses = certificate.iter().flat_map(|read| &read.addresses);
    Entry {
        holder: holder.to_string(),
        addresses: addresses.map(ToString::to_string).collect(),
        until: certificate.as_ref().map(|read| day(read.lifetime)),
        days_left: certificate.as_ref().map(left),
        problems: problems.iter().map(ToString::to_string).collect(),
    }
}

fn in_columns(entries: &[Entry]) -> TextTable {
    let mut rows = table(&["holder", "addresses", "until", "days left", "problems"]);
    for entry in entries {
        let or_dash = |text: String| if text.is_empty() { "-".to_owned() } else { text };
        let left = entry.days_left.map_or(String::new(), |days| days.to_string());
        rows.add_row([
            entry.holder.clone(),
            or_dash(entry.addresses.join(", ")),
            or_dash(entry.until.clone().unwrap_or_default()),
            or_dash(left),
            or_dash(entry.problems.join("; ")),
        ]);
    }
    rows
}
