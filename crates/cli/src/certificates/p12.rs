//! `trusswatch pki p12`: a person's certificate for a browser.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use pki::Holder;
use pki::browser::{self, BrowserFileError};

use super::CertificateDirectory;
use crate::failure::Failure;
use crate::output;

/// The environment variable with the password, used without a password file.
const VARIABLE: &str = "TRUSSWATCH_P12_PASSWORD";

/// Put a person's key and certificate into a file for browsers
///
/// Writes HOLDER.p12 beside the directories of certificates, readable by its owner only and encrypted with a password:
/// the first line of --password-file, or TRUSSWATCH_P12_PASSWORD; otherwise a password is generated and printed. The
/// person imports the file into the browser, which then presents the certificate to the web page. A renewed certificate
/// needs a new file.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Person: operator.NAME or observer.NAME
    #[arg(required = true, value_name = "HOLDER")]
    holders: Vec<Holder>,
    #[command(flatten)]
    place: CertificateDirectory,
    /// File with the password on its first line
    #[arg(long, value_name = "FILE")]
    password_file: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let given = given_password(arguments.password_file.as_deref())?;
    for holder in &arguments.holders {
        write(holder, &arguments.place, given.as_deref())?;
    }
    Ok(())
}

fn write(
    holder: &Holder,
    place: &CertificateDirectory,
    given: Option<&str>,
) -> Result<(), Failure> {
    let library = place.library();
    let file = library.directory().join(format!("{holder}.p12"));
    let made = if given.is_none() { Some(browser::password()?) } else { None };
    let password = given.or(made.as_deref()).unwrap_or_default();
    browser::write(&library.identity(holder), password, &file)?;
    let mut out = output::stdout();
    match &made {
        Some(made) => writeln!(out, "{}: {holder}, password {made}", file.display())?,
        None => writeln!(out, "{}: {holder}", file.display())?,
    }
    Ok(())
}

fn given_password(file: Option<&Path>) -> Result<Option<String>, Failure> {
    let Some(file) = file else {
        return Ok(std::env::var(VARIABLE).ok().filter(|password| !password.is_empty()));
    };
    let text = fs::read_to_string(file).map_err(|error| Failure::unreadable(file, error))?;
    Ok(Some(text.lines().next().unwrap_or_default().to_owned()))
}

impl From<BrowserFileError> for Failure {
    fn from(error: BrowserFileError) -> Failure {
        match error {
            BrowserFileError::Problems(problems) => {
                Failure::inputs(problems.iter().map(ToString::to_string).collect())
            }
            BrowserFileError::Sealing { .. } | BrowserFileError::NoRandomness => {
                Failure::runtime(error.to_string())
            }
            BrowserFileError::NoPerson(_) | BrowserFileError::Password(_) => {
                Failure::usage(error.to_string())
            }
            BrowserFileError::Writing { .. } => Failure::input(error.to_string()),
        }
    }
}
