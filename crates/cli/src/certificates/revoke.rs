//! `trusswatch pki revoke`: revokes a certificate.

use std::io::Write;
use std::path::Path;

use pki::credentials::Service;
use pki::lifetime::HOLDER_DAYS;
use pki::revocation::{self, RevokeError, Revoked};
use pki::{Authority, Holder, Lifetime};

use super::{CertificateDirectory, summary};
use crate::failure::Failure;
use crate::output;

/// Revoke the certificate of a lost key, and make a new key with a certificate of another name
///
/// Access control identifies a certificate by its name. The new certificate has the next generation in its name, e.g.
/// `module1~2.tower`, and the same addresses. The revoked certificate is kept in the directory `revoked`, without its
/// key, and its name is never issued again. It stays valid until the new rules are in force; the necessary steps are
/// printed.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Holder of the lost key
    holder: Holder,
    /// Make no new certificate: the holder is removed for good
    #[arg(long, conflicts_with = "days")]
    remove: bool,
    #[command(flatten)]
    place: CertificateDirectory,
    /// Days of validity of the new certificate, at most to the authority's end
    #[arg(long, default_value_t = HOLDER_DAYS, value_parser = clap::value_parser!(u16).range(1..=825))]
    days: u16,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { holder, remove, place, days } = arguments;
    let (authority, library) = (Authority::open(&place.directory)?, place.library());
    let revoked = if *remove {
        revocation::remove(&authority, &library, holder)
    } else {
        revocation::replace(&authority, &library, holder, Lifetime::of_days(*days))
    };
    let revoked = revoked?;
    let mut out = output::stdout();
    writeln!(out, "{}: {}, revoked", revoked.kept.display(), revoked.name)?;
    if !remove {
        writeln!(out, "{}", summary(&library.place_of(holder))?)?;
    }
    writeln!(out, "{}", next(arguments, &revoked))?;
    Ok(out.flush()?)
}

/// The remaining steps for the user, and the limits of revocation.
fn next(arguments: &Arguments, revoked: &Revoked) -> String {
    let Arguments { holder, remove, place, .. } = arguments;
    let directory = place.directory.display();
    let name = &revoked.name;
    let mut text = format!(
        "The lost key remains valid until these three steps are done:\n\
         1. generate the rules again, for each router with its former options:\n\
         \x20    trusswatch pki access STRUCTURE.toml --dir {directory} > router.json5\n\
         2. copy them to the routers, or without a router to every peer\n\
         3. restart these; a router by\n\
         \x20    systemctl restart trusswatch-router"
    );
    if !remove {
        text += &format!("\n{}", installation(holder, &place.library().place_of(holder)));
    }
    if !revoked.addresses.is_empty() {
        let addresses: Vec<String> = revoked.addresses.iter().map(ToString::to_string).collect();
        text += &format!(
            "\nClients of a router do not check names: with the lost key a process at {} can still impersonate it \
             until the certificate `{name}` expires. If that is possible, change the address or make a new authority.",
            addresses.join(" or ")
        );
    }
    text
}

/// How to install the holder's new key.
fn installation(holder: &Holder, directory: &Path) -> String {
    let place = directory.display();
    match Service::of(holder) {
        Some(service) => format!(
            "Then copy {place} to the computer of {holder}, and run there\n     \
             trusswatch pki install {holder} && rm -r {holder}\n     \
             systemctl restart {}",
            service.unit().trim_end_matches(".service")
        ),
        None => format!("Then send {place} to {holder}, to replace the old directory."),
    }
}

impl From<RevokeError> for Failure {
    fn from(error: RevokeError) -> Failure {
        match error {
            RevokeError::Issue(error) => error.into(),
            RevokeError::Removing { .. } => Failure::runtime(error.to_string()),
            RevokeError::Unknown { .. } | RevokeError::Already { .. } => {
                Failure::input(error.to_string())
            }
        }
    }
}
