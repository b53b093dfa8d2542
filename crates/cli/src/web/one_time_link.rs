//! `trusswatch web link`: creates a link that admits a user once.

use std::io::Write;
use std::path::PathBuf;
use std::time::Duration;

use web::{LinkError, PageAddress, PersonName};

use crate::failure::Failure;
use crate::output;

/// Make a link with which a person signs in to the page once
///
/// Prints the link; send it to the person over a private channel. Run this on the computer of `trusswatch web`, as
/// root or as the user that runs it. The journals record the person's name with every command.
#[derive(Debug, clap::Args)]
pub(super) struct OneTimeLinkArguments {
    /// Name of the person, recorded in the journals
    #[arg(value_name = "PERSON")]
    person: PersonName,
    /// The --state-dir of `trusswatch web`
    #[arg(long, value_name = "DIRECTORY", default_value = "/var/lib/trusswatch-web")]
    state_dir: PathBuf,
    /// Read-only access
    #[arg(long)]
    view_only: bool,
    /// Validity of the link, from 1s to 24h
    #[arg(long, value_name = "SPAN", default_value = "10m", value_parser = valid)]
    valid: Duration,
    /// Address of the page in the person's browser
    #[arg(long, value_name = "ADDRESS", default_value = "http://127.0.0.1:8480")]
    address: PageAddress,
}

/// Runs `trusswatch web link`.
pub(super) fn run(arguments: &OneTimeLinkArguments) -> Result<(), Failure> {
    let OneTimeLinkArguments { person, state_dir, view_only, valid, address } = arguments;
    let link = web::one_time_link(state_dir, person, !view_only, *valid)?;
    writeln!(output::stdout(), "{address}{link}")?;
    Ok(())
}

fn valid(text: &str) -> Result<Duration, String> {
    let span = humantime::parse_duration(text).ok().filter(|span| web::VALID.contains(span));
    span.ok_or_else(|| "write a time span from 1s to 24h, e.g. 10m".to_owned())
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Failure {
        match error {
            LinkError::Randomness(_) => Failure::runtime(error.to_string()),
            LinkError::Valid(_) => Failure::usage(error.to_string()),
            LinkError::Directory { .. } | LinkError::TooMany(_) => {
                Failure::input(error.to_string())
            }
        }
    }
}
