//! Provides services with their identities through the credential store of systemd.
//!
//! A unit contains `LoadCredential=key.pem:trusswatch.module1.key.pem`. The service manager reads that file from the
//! store, which only root can read, and makes it available to this service alone, as `key.pem` in
//! `/run/credentials/UNIT`, while the service runs. The names below are those in `deploy/systemd`.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::certificate::{Certificate, CertificateError};
use crate::holder::{CommonName, Holder, HolderError};
use crate::identity::{AUTHORITY, CERTIFICATE, Identity, IdentityProblem, KEY};
use crate::private_files::{make_private_directory, replace_private};

/// The store from which the service manager loads credentials.
pub const STORE: &str = "/etc/credstore";
/// The directory in which each unit has a subdirectory with its credentials.
const SHOWN: &str = "/run/credentials";

/// Prefix and suffix of the name of a diagnoser's unit, around the instance.
const DIAGNOSER: (&str, &str) = ("trusswatch-diagnoser@", ".service");
/// Prefix of the name of a client's unit.
const CLIENT: &str = "trusswatch-";
const PLANT: &str = "trusswatch-plant.service";
const ROUTER: &str = "trusswatch-router.service";
/// The services that observe: an operator or an observer of one of these names is the service of that name.
const CLIENTS: [&str; 3] = ["web", "notify", "recorder"];

/// A service that authenticates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Service {
    /// A module's diagnoser, by the instance of its unit.
    Diagnoser(String),
    /// The simulated plant.
    Plant,
    /// A router.
    Router,
    /// The page, the notifier or the recorder, by its name.
    Client(&'static str),
}

/// Why an identity was not installed.
#[derive(Debug, thiserror::Error)]
pub enum InstallError {
    /// The files are invalid.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Problems(Vec<IdentityProblem>),
    /// A certificate that cannot be read.
    #[error("{}: {reason}", file.display())]
    Certificate {
        /// The file.
        file: PathBuf,
        /// The cause.
        reason: CertificateError,
    },
    /// A certificate whose name is not that of a holder.
    #[error("`{file}`: {reason}")]
    Name {
        /// The file.
        file: PathBuf,
        /// The cause.
        reason: HolderError,
    },
    /// The certificate of a person.
    #[error(
        "`{0}` has no service; show its directory with `--tls`. An operator or observer that is a service is named `web`, \
         `notify` or `recorder`"
    )]
    NoService(CommonName),
    /// Services of this computer belong to another authority.
    #[error(
        "`{0}` is the certificate of another authority and is left as it is; remove it first if every \
         service of this computer gets a new identity"
    )]
    OtherAuthority(PathBuf),
    /// A file cannot be read, written or removed.
    #[error("`{file}` cannot be {done}: {reason}")]
    File {
        /// The file.
        file: PathBuf,
        /// The failed operation.
        done: &'static str,
        /// The cause.
        reason: io::Error,
    },
}

impl Service {
    /// The service of a holder; `None` for people. `operator.web` is not a person but the page.
    #[must_use]
    pub fn of(holder: &Holder) -> Option<Self> {
        match holder {
            Holder::Module(name) => Some(Service::Diagnoser(name.to_string())),
            Holder::Plant => Some(Service::Plant),
            Holder::Router(_) => Some(Service::Router),
            Holder::Operator(name) | Holder::Observer(name) => Self::of_client(&name.to_string()),
        }
    }

    fn of_client(name: &str) -> Option<Self> {
        CLIENTS.into_iter().find(|client| *client == name).map(Service::Client)
    }

    /// The service of a unit, if it has one.
    fn of_unit(unit: &str) -> Option<Self> {
        match unit {
            PLANT => Some(Service::Plant),
            ROUTER => Some(Service::Router),
            _ => {
                let name = unit.strip_suffix(DIAGNOSER.1)?;
                match name.strip_prefix(DIAGNOSER.0) {
                    Some(instance) => Some(Service::Diagnoser(instance.to_owned())),
                    None => Self::of_client(name.strip_prefix(CLIENT)?),
                }
            }
        }
    }

    /// The name of its unit.
    #[must_use]
    pub fn unit(&self) -> String {
        match self {
            Service::Diagnoser(instance) => format!("{}{instance}{}", DIAGNOSER.0, DIAGNOSER.1),
            Service::Plant => PLANT.to_owned(),
            Service::Router => ROUTER.to_owned(),
            Service::Client(name) => format!("{CLIENT}{name}{}", DIAGNOSER.1),
        }
    }

    /// The directory that contains its identity while it runs.
    #[must_use]
    pub fn shown(&self) -> PathBuf {
        Path::new(SHOWN).join(self.unit())
    }

    /// Its identity in a store.
    #[must_use]
    pub fn stored(&self, store: &Path) -> Identity {
        let name = match self {
            Service::Diagnoser(instance) => instance,
            Service::Plant => "plant",
            Service::Router => "router",
            Service::Client(name) => name,
        };
        Identity {
            authority: store.join(format!("trusswatch.{AUTHORITY}")),
            certificate: store.join(format!("trusswatch.{name}.{CERTIFICATE}")),
            key: store.join(format!("trusswatch.{name}.{KEY}")),
        }
    }
}

/// The identity in a directory. While a service does not run, its directory does not exist, and the identity is in the
/// store from which the service manager will load it.
#[must_use]
pub fn identity(directory: &Path) -> Identity {
    let unit = directory.strip_prefix(SHOWN).ok().and_then(Path::to_str);
    match unit.and_then(Service::of_unit) {
        Some(service) if !directory.exists() => service.stored(Path::new(STORE)),
        _ => Identity::in_directory(directory),
    }
}

/// Installs an identity in a store, replacing an older one of the same service and authority. The service loads it at
/// its next start.
///
/// # Errors
/// The identity is invalid, belongs to a person, or to another authority than the installed ones; or a file cannot be
/// written.
pub fn install(identity: &Identity, store: &Path) -> Result<Service, InstallError> {
    let mut problems = identity.problems(None, &[]);
    // This computer's clock may not be set yet.
    problems.retain(|problem| !problem.wrong.passes());
    if !problems.is_empty() {
        return Err(InstallError::Problems(problems));
    }
    let name = common_name(&identity.certificate)?;
    let service = Service::of(&name.issued.holder).ok_or(InstallError::NoService(name))?;
    let stored = service.stored(store);
    if stored.authority.exists()
        && certificate(&stored.authority)? != certificate(&identity.authority)?
    {
        return Err(InstallError::OtherAuthority(stored.authority));
    }
    make_private_directory(store).map_err(|reason| file_error(store, "made", reason))?;
    for (from, to) in [
        (&identity.authority, &stored.authority),
        (&identity.key, &stored.key),
        (&identity.certificate, &stored.certificate),
    ] {
        let text = fs::read_to_string(from).map_err(|reason| file_error(from, "read", reason))?;
        replace_private(to, &text).map_err(|reason| file_error(to, "written", reason))?;
    }
    Ok(service)
}

fn common_name(file: &Path) -> Result<CommonName, InstallError> {
    let name = Certificate::read(file).map_err(|error| unreadable(file, error))?.common_name;
    let refused = |reason| InstallError::Name { file: file.to_owned(), reason };
    name.unwrap_or_default().parse().map_err(refused)
}

/// The content of a certificate, independent of the layout of its file.
fn certificate(file: &Path) -> Result<Vec<u8>, InstallError> {
    let read = Certificate::read(file).map_err(|error| unreadable(file, error))?;
    Ok(read.der.to_vec())
}

fn unreadable(file: &Path, error: CertificateError) -> InstallError {
    InstallError::Certificate { file: file.to_owned(), reason: error }
}

fn file_error(file: &Path, done: &'static str, reason: io::Error) -> InstallError {
    InstallError::File { file: file.to_owned(), done, reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_are_those_that_the_units_load() {
        for (file, unit, holder, instance) in [
            ("trusswatch-diagnoser@.service", "trusswatch-diagnoser@m7.service", "m7", "m7"),
            (PLANT, PLANT, "plant", ""),
            (ROUTER, ROUTER, "router.ground", ""),
            ("trusswatch-web.service", "trusswatch-web.service", "operator.web", ""),
            ("trusswatch-notify.service", "trusswatch-notify.service", "observer.notify", ""),
            ("trusswatch-recorder.service", "trusswatch-recorder.service", "observer.recorder", ""),
        ] {
            let service = Service::of(&holder.parse().unwrap()).unwrap();
            assert_eq!(service.unit(), unit);
            assert_eq!(Service::of_unit(unit), Some(service.clone()));
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../deploy/systemd");
            let text = fs::read_to_string(folder.join(file)).unwrap().replace("%i", instance);
            let stored = service.stored(Path::new(STORE));
            for (name, file) in [
                (AUTHORITY, &stored.authority),
                (CERTIFICATE, &stored.certificate),
                (KEY, &stored.key),
            ] {
                let stored = file.strip_prefix(STORE).unwrap().display();
                let line = format!("LoadCredential={name}:{stored}\n");
                assert!(text.contains(&line), "{unit} has no line {line}");
            }
        }
        for person in ["operator.ada", "observer.wall"] {
            assert_eq!(Service::of(&person.parse().unwrap()), None);
        }
    }

    #[test]
    fn a_service_that_does_not_run_is_looked_up_in_the_store() {
        let absent = Service::Diagnoser("no-such-module".to_owned());
        assert_eq!(identity(&absent.shown()), absent.stored(Path::new(STORE)));
        for other in ["/run/credentials/ssh.service", "/run/credentials", "/somewhere"] {
            let other = Path::new(other);
            assert_eq!(identity(other), Identity::in_directory(other));
        }
    }
}
