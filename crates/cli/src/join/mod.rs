//! `trusswatch join`: configures diagnosers and plants as clients of a router.

mod network_table;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use daemon::config::{PlantFlags, load_diagnoser, load_plant};
use pki::credentials::Service;
use settings::ConfigErrors;

use crate::check::kind::FileKind;
use crate::failure::Failure;
use crate::output;

/// Make diagnosers and plants clients of a router, by TLS
///
/// Changes only the table `[network]` of their configurations; the services use the certificates that
/// `trusswatch pki install` has installed. A configuration that would become invalid is not changed.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Endpoint of the router, e.g. `tls/192.0.2.10:7447`
    router: String,
    /// Configurations of diagnosers and plants
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Directory of a certificate made by `trusswatch pki issue` [default: the installed certificate]
    #[arg(long, value_name = "DIRECTORY")]
    tls: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut out = output::stdout();
    for file in &arguments.files {
        let tls = join(file, arguments)?;
        let (file, router, tls) = (file.display(), &arguments.router, tls.display());
        writeln!(out, "{file}: client of {router} with the certificate in {tls}")?;
    }
    Ok(())
}

/// Changes a configuration; returns the directory of its certificate.
fn join(file: &Path, arguments: &Arguments) -> Result<PathBuf, Failure> {
    let text = fs::read_to_string(file).map_err(|error| Failure::unreadable(file, error))?;
    let kind = FileKind::of(file, &text).ok();
    let service = match kind {
        Some(FileKind::Plant) => Service::Plant,
        Some(FileKind::Diagnoser) => Service::Diagnoser(instance_of(file)),
        _ => {
            let right = "only diagnosers and plants connect to a router";
            return Err(Failure::input(format!(
                "{}: not the configuration of a diagnoser or a plant; {right}",
                file.display()
            )));
        }
    };
    let tls = arguments.tls.clone().unwrap_or_else(|| service.shown());
    let changed = network_table::of_client(&text, &arguments.router, &tls)
        .map_err(|problem| Failure::input(format!("{}: {problem}", file.display())))?;
    replace(file, &changed, |file| match service {
        Service::Diagnoser(_) => load_diagnoser(file).map(drop),
        _ => load_plant(file, &PlantFlags::default()).map(drop),
    })?;
    Ok(tls)
}

/// The instance of the diagnoser's unit that runs the file with this name.
fn instance_of(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Replaces the text of a file if the result is valid. The text is checked in the same directory, because its paths are
/// relative.
fn replace(
    file: &Path,
    text: &str,
    valid: impl Fn(&Path) -> Result<(), ConfigErrors>,
) -> Result<(), Failure> {
    let unwritten = |error: io::Error| Failure::unwritable(file, error);
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let permissions = file.metadata().map_err(unwritten)?.permissions();
    let mut beside = tempfile::Builder::new()
        .prefix(".new-")
        .permissions(permissions)
        .tempfile_in(folder)
        .map_err(unwritten)?;
    beside.write_all(text.as_bytes()).map_err(unwritten)?;
    beside.as_file().sync_all().map_err(unwritten)?;
    valid(beside.path()).map_err(|errors| as_mistakes_of(file, beside.path(), errors))?;
    beside.persist(file).map_err(|error| unwritten(error.error))?;
    File::open(folder).and_then(|folder| folder.sync_all()).map_err(unwritten)
}

/// Reports errors under the name of the user's file.
fn as_mistakes_of(file: &Path, beside: &Path, mut errors: ConfigErrors) -> Failure {
    for error in errors.0.iter_mut().filter(|error| error.file == beside) {
        error.file = file.to_owned();
    }
    errors.into()
}
