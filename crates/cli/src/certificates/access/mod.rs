//! `trusswatch pki access`: Zenoh settings for access control.

pub(super) mod fleet;
mod parties;
mod rules;
mod settings;

use std::collections::BTreeSet;
use std::fmt::Display;
use std::path::PathBuf;

use pki::Holder;
use truss::Structure;

use crate::failure::Failure;
use crate::model;
use parties::{Gateway, Linked, People};
use settings::{Common, gateway_endpoint};

/// Print Zenoh settings for access control in a structure
///
/// A module may publish and reply only on its own keys, operators may issue commands,
/// observers may only read; all other access is denied. Operators and observers are given here or
/// by the directory of certificates. The settings of linked routers name each other with --router, each with the
/// holders on the other's side of the link.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Description of the structure (TOML), for its modules
    structure: PathBuf,
    /// Process that enforces access control
    #[arg(long, value_enum, default_value = "router")]
    mode: EnforcedBy,
    #[command(flatten)]
    common: Common,
    /// A linked router with the holders on its side, also those behind further routers, e.g.
    /// `top=module3,module4,operator.ada`; without `=` it may forward messages of every holder of the structure. May be
    /// repeated
    #[arg(long = "router", value_name = "NAME[=HOLDER,...]")]
    routers: Vec<Linked>,
    #[command(flatten)]
    to_fleet: ToFleet,
}

/// Arguments of a router that is the gateway of its structure to a fleet.
#[derive(Debug, clap::Args)]
struct ToFleet {
    /// Make this router the structure's gateway to this router of a fleet; it forwards commands of these operators of the
    /// fleet to modules, e.g. `hub.fleet=operator.ada`. Only faults, phases and presence leave the structure
    #[arg(long, value_name = "NAME.FLEET[=OPERATOR,...]", requires_all = ["fleet_endpoint", "fleet_tls"])]
    gateway: Option<Gateway>,
    /// Endpoint of the fleet's router, e.g. `tls/192.0.2.99:7447`
    #[arg(long, value_name = "ENDPOINT", requires = "gateway")]
    fleet_endpoint: Option<String>,
    /// Directory of the gateway's certificate from the fleet's authority
    #[arg(long, value_name = "DIRECTORY", requires = "gateway")]
    fleet_tls: Option<PathBuf>,
}

/// The process that enforces access control.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum EnforcedBy {
    /// A router, for clients
    Router,
    /// Each peer
    Peer,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { mode, common, .. } = arguments;
    common.check_endpoints()?;
    let structure = model::read(&arguments.structure)?;
    let people = people(arguments)?;
    check_sides(&structure, &people)?;
    check_gateway(&structure, *mode, people.gateway.as_ref())?;
    let connect = arguments.to_fleet.endpoint()?;
    let heading = comment(&structure, *mode, &people);
    let access = rules::of_structure(&structure, &people);
    match mode {
        EnforcedBy::Router => common.print_router(&heading, access, connect.as_deref()),
        EnforcedBy::Peer => common.print_peer(&heading, access),
    }
}

impl ToFleet {
    /// The endpoint that the gateway connects to, with its certificate.
    fn endpoint(&self) -> Result<Option<String>, Failure> {
        match (&self.fleet_endpoint, &self.fleet_tls) {
            (Some(place), Some(directory)) => gateway_endpoint(place, directory).map(Some),
            _ => Ok(None),
        }
    }
}

/// Checks that a gateway is a router, and that its structure is not the fleet itself.
fn check_gateway(
    structure: &Structure,
    mode: EnforcedBy,
    gateway: Option<&Gateway>,
) -> Result<(), Failure> {
    let Some(gateway) = gateway else { return Ok(()) };
    if mode != EnforcedBy::Router {
        return Err(Failure::usage("--gateway with `--mode peer`; only a router can be a gateway"));
    }
    let fleet = &gateway.router.structure;
    if *fleet == structure.name {
        return Err(Failure::usage(format!(
            "--gateway {}: `{fleet}` is the name of the structure; give the fleet another name",
            gateway.router
        )));
    }
    Ok(())
}

/// Checks that every module behind a router exists.
fn check_sides(structure: &Structure, people: &People) -> Result<(), Failure> {
    let modules = || structure.equipped().map(|module| &module.name);
    for Linked { router, side } in &people.routers {
        for holder in side.iter().flatten() {
            if let Holder::Module(name) = holder
                && !modules().any(|known| known == name)
            {
                let known: Vec<String> = modules().map(|known| format!("`{known}`")).collect();
                return Err(Failure::usage(format!(
                    "--router {router}: unknown module `{name}` in `{}`; expected one of {}",
                    structure.name,
                    known.join(", ")
                )));
            }
        }
    }
    Ok(())
}

fn people(arguments: &Arguments) -> Result<People, Failure> {
    let routers = arguments.routers.iter().cloned().collect();
    let gateway = arguments.to_fleet.gateway.clone();
    Ok(People { routers, gateway, ..arguments.common.people()? })
}

/// The header of the settings: their purpose, and how they were generated.
fn comment(structure: &Structure, mode: EnforcedBy, people: &People) -> String {
    let (owner, others) = match mode {
        EnforcedBy::Router => ("a router", "`client-tls.json5`"),
        EnforcedBy::Peer => ("a module computer", "the same settings"),
    };
    let operators = named("operator", &people.operators);
    let observers = named("observer", &people.observers);
    let routers: Vec<String> =
        people.routers.iter().map(|linked| linked.router.to_string()).collect();
    let routers = match &routers[..] {
        [] => String::new(),
        routers => format!("; linked routers: {}", routers.join(", ")),
    };
    let gateway = people.gateway.as_ref();
    let gateway =
        gateway.map_or(String::new(), |gateway| format!("; gateway to {}", gateway.router));
    format!(
        "// Zenoh settings of {owner} in the structure `{}`, for others with {others}: mutual TLS and access\n\
         // control. Made by `trusswatch pki access`; run that again instead of editing the rules.\n\
         // {operators}; {observers}{routers}{gateway}. Certificates and endpoints are given by `tls`, `listen` and\n\
         // `connect` of the configuration that names this file, or by `--tls`, `--listen` and `--connect`.",
        structure.name
    )
}

/// Names in a header.
fn named<N: Display>(role: &str, names: &BTreeSet<N>) -> String {
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    match &names[..] {
        [] => format!("no {role}s"),
        names => format!("{role}s: {}", names.join(", ")),
    }
}
