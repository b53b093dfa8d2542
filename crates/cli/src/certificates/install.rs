//! `trusswatch pki install`: installs identities for this computer's services.

use std::io::Write;
use std::path::{Path, PathBuf};

use pki::credentials::{self, InstallError, STORE, Service};
use pki::{Certificate, Identity};

use super::day;
use crate::failure::Failure;
use crate::output;

/// Install the certificates of this computer's services
///
/// Copies the three files of a directory made by `trusswatch pki issue` to /etc/credstore, readable by root only. The
/// service manager passes them to the holder's service at its start. An older certificate of the same service is
/// replaced. The page, the notifier and the recorder have the certificates of an operator or observer with their name: `operator.web`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Directories of a module, the plant, a router, or of `web`, `notify` or `recorder`
    #[arg(required = true, value_name = "DIRECTORY")]
    directories: Vec<PathBuf>,
    /// Directory from which the service manager loads credentials
    #[arg(long, value_name = "DIRECTORY", default_value = STORE)]
    store: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut out = output::stdout();
    for directory in &arguments.directories {
        let service = credentials::install(&Identity::in_directory(directory), &arguments.store)?;
        writeln!(out, "{}", summary(&service, &arguments.store)?)?;
    }
    Ok(())
}

fn summary(service: &Service, store: &Path) -> Result<String, Failure> {
    let file = service.stored(store).certificate;
    let installed = Certificate::read(&file)
        .map_err(|error| Failure::runtime(format!("{}: {error}", file.display())))?;
    let name = installed.common_name.unwrap_or_default();
    let (unit, until) = (service.unit(), day(installed.lifetime));
    Ok(format!("{}: {name} for {unit}, until {until}", store.display()))
}

impl From<InstallError> for Failure {
    fn from(error: InstallError) -> Failure {
        match error {
            InstallError::Problems(problems) => {
                Failure::inputs(problems.iter().map(ToString::to_string).collect())
            }
            InstallError::File { .. } => Failure::runtime(error.to_string()),
            _ => Failure::input(error.to_string()),
        }
    }
}
