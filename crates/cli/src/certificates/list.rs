//! `trusswatch pki list`: lists holders, expiry and problems of certificates.

use pki::{Authority, Certificate, CommonName, Generations, Holder, Issued, Library};
use serde::Serialize;
use serde_json::json;

use super::{CertificateDirectory, day};
use crate::failure::Failure;
use crate::output;
use crate::table::{TextTable, WidthArguments, table};

/// List certificates with their expiry; exit code 1 if one has a problem
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    place: CertificateDirectory,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    width: WidthArguments,
}

/// An entry of the list.
#[derive(Debug, Serialize)]
struct ListedCertificate {
    holder: String,
    common_name: Option<String>,
    addresses: Vec<String>,
    until: Option<String>,
    days_left: Option<i64>,
    problems: Vec<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let directory = &arguments.place.directory;
    let authority = Authority::open(directory)?;
    let library = arguments.place.library();
    let read = || Ok((library.holders()?, library.revoked()?, library.generations()?));
    let (holders, revoked, generations) =
        read().map_err(|error: std::io::Error| Failure::unreadable(directory, error))?;
    let entries = holders.iter().map(|holder| entry(&library, &authority, &generations, holder));
    let entries: Vec<ListedCertificate> = entries.collect();
    let revoked: Vec<(String, Option<String>)> =
        revoked.iter().map(|issued| past(&library, &authority, issued)).collect();
    output::print(&if arguments.json {
        let revoked = revoked
            .iter()
            .map(|(common_name, until)| json!({ "common_name": common_name, "until": until }));
        let revoked: Vec<_> = revoked.collect();
        output::text(&json!({ "certificates": entries, "revoked": revoked }))?
    } else {
        let until = day(authority.certificate().lifetime);
        let table = in_columns(&entries).text(arguments.width.limit());
        let mut text = format!("authority of {}, until {until}\n{table}\n", authority.structure());
        for (name, until) in &revoked {
            text += &format!("revoked: {name}, until {}\n", until.as_deref().unwrap_or("-"));
        }
        text
    })?;
    let sound = entries.iter().all(|entry| entry.problems.is_empty());
    if sound { Ok(()) } else { Err(Failure::reported()) }
}

fn entry(
    library: &Library,
    authority: &Authority,
    generations: &Generations,
    holder: &Holder,
) -> ListedCertificate {
    let identity = library.identity(holder);
    let certificate = Certificate::read(&identity.certificate).ok();
    let expected = CommonName::new(holder.clone(), authority.structure().clone()).ok();
    let mut problems = identity.problems(expected.as_ref(), &[]);
    // The key may have been moved to its holder, where it belongs.
    if !identity.key.exists() {
        problems.retain(|problem| problem.file != identity.key);
    }
    let left = |read: &Certificate| (read.lifetime.until - pki::lifetime::now()).whole_days();
    let addresses = certificate.iter().flat_map(|read| &read.addresses);
    let mut problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
    // For instance a file restored from a backup.
    if library.present(holder).is_some_and(|present| present < generations.of(holder.clone())) {
        let (file, place) = (identity.certificate.display(), library.place_of(holder));
        let right = format!("remove `{}` and issue `{holder}` again", place.display());
        problems.push(format!("{file}: is revoked; {right}"));
    }
    ListedCertificate {
        holder: holder.to_string(),
        addresses: addresses.map(ToString::to_string).collect(),
        common_name: certificate.as_ref().and_then(|read| read.common_name.clone()),
        until: certificate.as_ref().map(|read| day(read.lifetime)),
        days_left: certificate.as_ref().map(left),
        problems,
    }
}

/// The common name of a revoked certificate, and its expiry.
fn past(library: &Library, authority: &Authority, issued: &Issued) -> (String, Option<String>) {
    let read = Certificate::read(&library.place_of_revoked(issued)).ok();
    let name = CommonName { issued: issued.clone(), structure: authority.structure().clone() };
    (name.to_string(), read.map(|read| day(read.lifetime)))
}

fn in_columns(entries: &[ListedCertificate]) -> TextTable {
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
