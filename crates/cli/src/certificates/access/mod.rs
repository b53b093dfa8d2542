//! `trusswatch pki access`: Zenoh settings for access control.

mod document;
mod rules;
mod side;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use pki::{Generations, Holder, Library};
use session::{DEFAULT_LEASE_MS, LEASES_MS, endpoint};
use truss::Structure;

use super::unreadable;
use crate::failure::Failure;
use document::Document;
use rules::{AccessControl, People};
use side::{Linked, Side};

/// Print Zenoh settings for access control in a structure
///
/// A module may write only its own keys and answer only its own questions, operators may issue commands,
/// observers may only read; all other access is denied. Operators and observers are those named here and
/// those in the directory of certificates. Routers that are linked to each other are named to each other, each with
/// those who are on its side of the link.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Description of the structure (TOML), for its modules
    structure: PathBuf,
    /// Kind of process that the settings are for
    #[arg(long, value_enum, default_value = "router")]
    mode: Mode,
    /// Endpoint to listen on, e.g. `tls/192.0.2.10:7447`; may be repeated. Without any it is one on the
    /// loopback
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,
    /// An operator, who may issue commands; may be repeated
    #[arg(long = "operator", value_name = "NAME")]
    operators: Vec<pki::holder::BearerName>,
    /// An observer, who may only read; may be repeated
    #[arg(long = "observer", value_name = "NAME")]
    observers: Vec<pki::holder::BearerName>,
    /// A link whose other side is silent for this long is dead [ms]; more than the default for long or lossy links
    #[arg(long, value_name = "MS", default_value_t = DEFAULT_LEASE_MS, value_parser = lease_ms)]
    lease_ms: u32,
    /// A router that this one is linked to, with those on its side, behind further routers too, e.g.
    /// `top=module3,module4,operator.ada`; without `=` it may pass on what anybody of the structure may say. May be
    /// repeated
    #[arg(long = "router", value_name = "NAME[=HOLDER,...]")]
    routers: Vec<Linked>,
    /// Directory of certificates, whose operators and observers are added. Who has had a certificate
    /// revoked is admitted by the next one only; without it, everybody by the first one
    #[arg(long = "dir", value_name = "DIRECTORY")]
    directory: Option<PathBuf>,
}

/// The process that enforces it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Mode {
    /// A router, for clients
    Router,
    /// Each peer
    Peer,
}

/// Reads a lease \[ms\].
fn lease_ms(text: &str) -> Result<u32, String> {
    let lease_ms = text.parse().ok().filter(|lease_ms| LEASES_MS.contains(lease_ms));
    lease_ms.ok_or_else(|| format!("use {} to {} ms", LEASES_MS.start(), LEASES_MS.end()))
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    check_endpoints(&arguments.listen)?;
    let structure = read(&arguments.structure)?;
    let people = people(arguments)?;
    check_sides(&structure, &people)?;
    let access = AccessControl::of(&structure, &people);
    let lease_ms = arguments.lease_ms;
    let document = match arguments.mode {
        Mode::Router => Document::of_router(access, &arguments.listen, lease_ms),
        Mode::Peer => Document::of_peer(access, &arguments.listen, lease_ms),
    };
    let mut out = io::stdout().lock();
    writeln!(out, "{}", comment(&structure, arguments.mode, &people))?;
    serde_json::to_writer_pretty(&mut out, &document)?;
    writeln!(out)?;
    Ok(out.flush()?)
}

/// Certificates are seen on TLS only.
fn check_endpoints(endpoints: &[String]) -> Result<(), Failure> {
    let is_tls = |text: &str| endpoint(text).is_ok_and(|read| read.protocol().as_str() == "tls");
    match endpoints.iter().find(|text| !is_tls(text)) {
        Some(text) => Err(Failure::input(format!(
            "`{text}` is no endpoint of TLS; write e.g. `tls/192.0.2.10:7447`"
        ))),
        None => Ok(()),
    }
}

/// A module that there is not is behind no router.
fn check_sides(structure: &Structure, people: &People) -> Result<(), Failure> {
    let modules = || structure.equipped().map(|module| &module.name);
    for Linked { router, side } in &people.routers {
        let Side::These(holders) = side else { continue };
        for holder in holders {
            if let Holder::Module(name) = holder
                && !modules().any(|known| known == name)
            {
                let known: Vec<String> = modules().map(|known| format!("`{known}`")).collect();
                return Err(Failure::usage(format!(
                    "--router {router}: `{name}` is no equipped module of `{}`; there are {}",
                    structure.name,
                    known.join(", ")
                )));
            }
        }
    }
    Ok(())
}

fn read(file: &Path) -> Result<Structure, Failure> {
    let name = file.display();
    let text = std::fs::read_to_string(file)
        .map_err(|error| Failure::input(format!("cannot read `{name}`: {error}")))?;
    Structure::from_toml(&text).map_err(|errors| {
        Failure::inputs(errors.iter().map(|error| format!("{name}: {error}")).collect())
    })
}

fn people(arguments: &Arguments) -> Result<People, Failure> {
    let mut people = People {
        operators: arguments.operators.iter().cloned().collect(),
        observers: arguments.observers.iter().cloned().collect(),
        routers: arguments.routers.iter().cloned().collect(),
        generations: Generations::default(),
    };
    if let Some(directory) = &arguments.directory {
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
    }
    Ok(people)
}

/// The heading of the settings: what they are for and how they were made.
fn comment(structure: &Structure, mode: Mode, people: &People) -> String {
    let (owner, others) = match mode {
        Mode::Router => ("a router", "`client-tls.json5`"),
        Mode::Peer => ("a module computer", "the same settings"),
    };
    let named = |role: &str, names: Vec<String>| match &names[..] {
        [] => format!("no {role}s"),
        names => format!("{role}s: {}", names.join(", ")),
    };
    let operators = named("operator", people.operators.iter().map(ToString::to_string).collect());
    let observers = named("observer", people.observers.iter().map(ToString::to_string).collect());
    let routers: Vec<String> =
        people.routers.iter().map(|linked| linked.router.to_string()).collect();
    let routers = match &routers[..] {
        [] => String::new(),
        routers => format!("; linked routers: {}", routers.join(", ")),
    };
    format!(
        "// Zenoh settings of {owner} in the structure `{}`, for others with {others}: mutual TLS and access\n\
         // control. Made by `trusswatch pki access`; run that again instead of changing the rules by hand.\n\
         // {operators}; {observers}{routers}. Certificates and endpoints are given by `tls`, `listen` and\n\
         // `connect` of the configuration that names this file, or by `--tls`, `--listen` and `--connect`.",
        structure.name
    )
}
