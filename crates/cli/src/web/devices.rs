//! `trusswatch web devices`: which devices stay signed in to the page; signs them out.

use std::io::Write;
use std::path::PathBuf;

use vocabulary::words::utc;
use web::{Device, PersonName};

use crate::failure::Failure;
use crate::output;

/// List the devices that stay signed in to the page, or sign out a person's
///
/// Run this on the computer of `trusswatch web`, as root or as the user that runs it. A device that is signed out loses
/// the page within a second.
#[derive(Debug, clap::Args)]
pub(super) struct DevicesArguments {
    /// Sign out all devices of this person
    #[arg(long, value_name = "PERSON")]
    sign_out: Option<PersonName>,
    /// The --state-dir of `trusswatch web`
    #[arg(long, value_name = "DIRECTORY", default_value = "/var/lib/trusswatch-web")]
    state_dir: PathBuf,
}

/// Runs `trusswatch web devices`.
pub(super) fn run(arguments: &DevicesArguments) -> Result<(), Failure> {
    let DevicesArguments { sign_out, state_dir } = arguments;
    let mut out = output::stdout();
    if let Some(person) = sign_out {
        let count = web::sign_out_devices(state_dir, person)?;
        let name = person.as_str();
        return Ok(writeln!(out, "{name}: {count} signed out")?);
    }
    let devices = web::devices(state_dir)?;
    if devices.is_empty() {
        return Ok(writeln!(out, "no device stays signed in")?);
    }
    for Device { person, may_order, until_unix_s } in devices {
        let access = if may_order { "may order" } else { "may look" };
        let until = utc(until_unix_s.saturating_mul(1_000_000_000));
        writeln!(out, "{person}  {access}  until {until}")?;
    }
    Ok(())
}
