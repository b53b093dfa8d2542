//! What the settings of every process that enforces access control have in common.

use std::path::PathBuf;

use pki::holder::BearerName;
use pki::{Generations, Holder, Library};
use session::{DEFAULT_LEASE_MS, LEASES_MS, endpoint};

use super::super::unreadable;
use super::rules::People;
use crate::failure::Failure;

/// Where it listens, for whom, and when a link is dead.
#[derive(Debug, clap::Args)]
pub(super) struct Common {
    /// Endpoint to listen on, e.g. `tls/192.0.2.10:7447`; may be repeated. Without any it is one on the
    /// loopback
    #[arg(long, value_name = "ENDPOINT")]
    pub(super) listen: Vec<String>,
    /// An operator, who may issue commands; may be repeated
    #[arg(long = "operator", value_name = "NAME")]
    operators: Vec<BearerName>,
    /// An observer, who may only read; may be repeated
    #[arg(long = "observer", value_name = "NAME")]
    observers: Vec<BearerName>,
    /// A link whose other side is silent for this long is dead [ms]; more than the default for long or lossy links
    #[arg(long, value_name = "MS", default_value_t = DEFAULT_LEASE_MS, value_parser = lease_ms)]
    pub(super) lease_ms: u32,
    /// Directory of certificates, whose operators and observers are added. Who has had a certificate
    /// revoked is admitted by the next one only; without it, everybody by the first one
    #[arg(long = "dir", value_name = "DIRECTORY")]
    directory: Option<PathBuf>,
}

impl Common {
    /// Those named, and those in the directory.
    pub(super) fn people(&self) -> Result<People, Failure> {
        let mut people = People {
            operators: self.operators.iter().cloned().collect(),
            observers: self.observers.iter().cloned().collect(),
            generations: Generations::default(),
            ..People::default()
        };
        let Some(directory) = &self.directory else { return Ok(people) };
        let library = Library::at(directory);
        let read = || Ok((library.holders()?, library.generations()?));
        let (holders, generations) = read().map_err(|error| unreadable(directory, &error))?;
        people.generations = generations;
        for holder in holders {
            match holder {
                Holder::Operator(name) => drop(people.operators.insert(name)),
                Holder::Observer(name) => drop(people.observers.insert(name)),
                Holder::Module(_) | Holder::Plant | Holder::Router(_) => {}
            }
        }
        Ok(people)
    }
}

/// Reads a lease \[ms\].
fn lease_ms(text: &str) -> Result<u32, String> {
    let lease_ms = text.parse().ok().filter(|lease_ms| LEASES_MS.contains(lease_ms));
    lease_ms.ok_or_else(|| format!("use {} to {} ms", LEASES_MS.start(), LEASES_MS.end()))
}

/// Certificates are seen on TLS only.
pub(super) fn check_endpoints(endpoints: &[String]) -> Result<(), Failure> {
    let is_tls = |text: &str| endpoint(text).is_ok_and(|read| read.protocol().as_str() == "tls");
    match endpoints.iter().find(|text| !is_tls(text)) {
        Some(text) => Err(Failure::input(format!(
            "`{text}` is no endpoint of TLS; write e.g. `tls/192.0.2.10:7447`"
        ))),
        None => Ok(()),
    }
}
