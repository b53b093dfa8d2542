//! `trusswatch pki list`: who has a certificate, until when, and what is wrong with it.

use std::io::{self, Write};

use pki::{Authority, Certificate, CommonName, Generations, Holder, Issued, Library};
use serde::Serialize;

use super::{Place, day, refused, unreadable};
use crate::failure::Failure;
use crate::output;
use crate::table::{TextTable, WidthArguments, table};

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
    revoked: &'a [Past],
}

/// A certificate as it is listed.
#[derive(Debug, Serialize)]
struct Entry {
    holder: String,
    common_name: Option<String>,
    addresses: Vec<String>,
    until: Option<String>,
    days_left: Option<i64>,
    problems: Vec<String>,
}

/// A revoked one.
#[derive(Debug, Serialize)]
struct Past {
    common_name: String,
    until: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let directory = &arguments.place.directory;
    let authority = Authority::open(directory).map_err(refused)?;
    let library = arguments.place.library();
    let read = || Ok((library.holders()?, library.revoked()?, library.generations()?));
    let (holders, revoked, generations) = read().map_err(|error| unreadable(directory, &error))?;
    let entries = holders.iter().map(|holder| entry(&library, &authority, &generations, holder));
    let entries: Vec<Entry> = entries.collect();
    let revoked: Vec<Past> =
        revoked.iter().map(|issued| past(&library, &authority, issued)).collect();
    let mut out = io::stdout().lock();
    if arguments.json {
        write!(out, "{}", output::text(&Document { certificates: &entries, revoked: &revoked })?)?;
    } else {
        let until = day(authority.certificate().lifetime);
        writeln!(out, "authority of {}, until {until}", authority.structure())?;
        writeln!(out, "{}", in_columns(&entries).text(arguments.width.limit()))?;
        for past in &revoked {
            let until = past.until.as_deref().unwrap_or("-");
            writeln!(out, "revoked: {}, until {until}", past.common_name)?;
        }
    }
    out.flush()?;
    let sound = entries.iter().all(|entry| entry.problems.is_empty());
    if sound { Ok(()) } else { Err(Failure::reported()) }
}

fn entry(
    library: &Library,
    authority: &Authority,
    generations: &Generations,
    holder: &Holder,
) -> Entry {
    let identity = library.identity(holder);
    let certificate = Certificate::read(&identity.certificate).ok();
    let expected = CommonName::new(holder.clone(), authority.structure().clone()).ok();
    let mut problems = identity.problems(expected.as_ref(), &[]);
    // The key may have gone to its holder, which is where it belongs.
    if !identity.key.exists() {
        problems.retain(|problem| problem.file != identity.key);
    }
    let left = |read: &Certificate| (read.lifetime.until - pki::lifetime::now()).whole_days();
    let addresses = certificate.iter().flat_map(|read| &read.addresses);
    let mut problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
    // From a backup, for instance.
    if library.present(holder).is_some_and(|present| present < generations.of(holder.clone())) {
        let (file, place) = (identity.certificate.display(), library.place_of(holder));
        let right = format!("remove `{}` and issue `{holder}` again", place.display());
        problems.push(format!("{file}: is revoked; {right}"));
    }
    Entry {
        holder: holder.to_string(),
        addresses: addresses.map(ToString::to_string).collect(),
        common_name: certificate.as_ref().and_then(|read| read.common_name.clone()),
        until: certificate.as_ref().map(|read| day(read.lifetime)),
        days_left: certificate.as_ref().map(left),
        problems,
    }
}

fn past(library: &Library, authority: &Authority, issued: &Issued) -> Past {
    let read = Certificate::read(&library.place_of_revoked(issued)).ok();
    let name = CommonName { issued: issued.clone(), structure: authority.structure().clone() };
    Past { common_name: name.to_string(), until: read.map(|read| day(read.lifetime)) }
}

fn in_columns(entries: &[Entry]) -> TextTable {
    let mut rows = table(&["certificate", "addresses", "until", "days left", "problems"]);
    for entry in entries {
        let or_dash = |text: String| if text.is_empty() { "-".to_owned() } else { text };
        let left = entry.days_left.map_or(String::new(), |days| days.to_string());
        rows.add_row([
            entry.common_name.as_ref().unwrap_or(&entry.holder).clone(),
            or_dash(entry.addresses.join(", ")),
            or_dash(entry.until.clone().unwrap_or_default()),
            or_dash(left),
            or_dash(entry.problems.join("; ")),
        ]);
    }
    rows
}
