//! `trusswatch pki`: the structure's authority, certificates and access control.

mod access;
mod install;
mod issue;
mod list;
mod p12;
mod revoke;

use std::path::{Path, PathBuf};

use clap::Subcommand;
use pki::{Certificate, Identity, IssueError, Library};

use crate::failure::Failure;

const AFTER_HELP: &str = "\
HOLDER is the name of a module, `plant`, `router.NAME`, `operator.NAME` or `observer.NAME`. Move a holder's \
whole directory to the holder's computer over a private channel; keep the authority's offline.";

/// Make certificates for modules, routers and people, and settings for access control
#[derive(Debug, clap::Args)]
#[command(arg_required_else_help = true, after_long_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: PkiCommand,
}

#[derive(Debug, Subcommand)]
enum PkiCommand {
    Authority(issue::AuthorityArguments),
    Issue(issue::IssueArguments),
    Install(install::Arguments),
    Renew(issue::RenewArguments),
    Revoke(revoke::Arguments),
    List(list::Arguments),
    P12(p12::Arguments),
    Access(access::Arguments),
    Fleet(access::fleet::Arguments),
}

/// The directory of certificates.
#[derive(Debug, clap::Args)]
struct CertificateDirectory {
    /// Directory of the authority and of every certificate that it has issued
    #[arg(long = "dir", value_name = "DIRECTORY", default_value = "pki")]
    directory: PathBuf,
}

impl CertificateDirectory {
    fn library(&self) -> Library {
        Library::at(&self.directory)
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        PkiCommand::Authority(arguments) => issue::make_authority(arguments),
        PkiCommand::Issue(arguments) => issue::issue(arguments),
        PkiCommand::Install(arguments) => install::run(arguments),
        PkiCommand::Renew(arguments) => issue::renew(arguments),
        PkiCommand::Revoke(arguments) => revoke::run(arguments),
        PkiCommand::List(arguments) => list::run(arguments),
        PkiCommand::P12(arguments) => p12::run(arguments),
        PkiCommand::Access(arguments) => access::run(arguments),
        PkiCommand::Fleet(arguments) => access::fleet::run(arguments),
    }
}

/// A file or directory is not usable, or the operation failed.
impl From<IssueError> for Failure {
    fn from(error: IssueError) -> Failure {
        match error {
            IssueError::Write { .. } | IssueError::Making(_) | IssueError::NoRandomness => {
                Failure::runtime(error.to_string())
            }
            _ => Failure::input(error.to_string()),
        }
    }
}

/// A directory, with the holder of the certificate in it.
fn summary(directory: &Path) -> Result<String, Failure> {
    let file = Identity::in_directory(directory).certificate;
    let issued = Certificate::read(&file)
        .map_err(|error| Failure::runtime(format!("{}: {error}", file.display())))?;
    let name = issued.common_name.unwrap_or_default();
    Ok(format!("{}: {name}, until {}", directory.display(), day(issued.lifetime)))
}

/// The day on which a certificate expires, in a readable format.
fn day(lifetime: pki::Lifetime) -> String {
    lifetime.until.date().to_string()
}
