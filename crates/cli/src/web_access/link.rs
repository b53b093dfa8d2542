//! `trusswatch web link`: lets a person in, once.

use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

use web::{LinkError, Origin, PersonName};

use crate::failure::Failure;

/// Make a link by which a person signs in to the page, once
///
/// Prints the link; give it to the person by a way that nobody else reads. Run this as root or as the user that
/// `trusswatch web` runs as, on its computer. The person's name stands in the journals with every order.
#[derive(Debug, clap::Args)]
pub(crate) struct LinkArguments {
    /// The person's name, as journals are to have it
    #[arg(value_name = "PERSON")]
    person: PersonName,
    /// The directory that `trusswatch web` has as --state-dir
    #[arg(long, value_name = "DIRECTORY", default_value = "/var/lib/trusswatch-web")]
    state_dir: PathBuf,
    /// The person may look, and order nothing
    #[arg(long)]
    view_only: bool,
    /// For how long the link is good, from 1s to 24h
    #[arg(long, value_name = "SPAN", default_value = "10m", value_parser = valid)]
    valid: Duration,
    /// The address of the page, as the person's browser has it
    #[arg(long, value_name = "ADDRESS", default_value = "http://127.0.0.1:8480")]
    address: Origin,
}

/// Runs `trusswatch web link`.
pub(crate) fn run(arguments: &LinkArguments) -> Result<(), Failure> {
    let LinkArguments { person, state_dir, view_only, valid, address } = arguments;
    let link = web::one_time_link(state_dir, person, !view_only, *valid).map_err(refused)?;
    writeln!(io::stdout(), "{address}{link}")?;
    Ok(())
}

fn valid(text: &str) -> Result<Duration, String> {
    let span = humantime::parse_duration(text).ok().filter(|span| web::VALID.contains(span));
    span.ok_or_else(|| "write a time span from 1s to 24h, e.g. 10m".to_owned())
}

fn refused(error: LinkError) -> Failure {
    match error {
        LinkError::Randomness(_) => Failure::runtime(error.to_string()),
        LinkError::Valid(_) => Failure::usage(error.to_string()),
        LinkError::Directory { .. } | LinkError::TooMany(_) => Failure::input(error.to_string()),
    }
}
