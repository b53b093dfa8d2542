//! `trusswatch pki fleet`: Zenoh settings for the router of a fleet.

use vocabulary::StructureName;

use super::named;
use super::parties::Fleet;
use super::rules;
use super::settings::Common;
use crate::failure::Failure;

/// Print Zenoh settings for the router of a fleet of structures
///
/// A fleet has its own name and authority. Each structure's gateway connects to the fleet's router with a certificate
/// that the fleet's authority issued for the structure's name, e.g. `router.tower`. It may forward faults, phases and
/// presence of its structure and reply for it; operators of the fleet may issue commands to the modules of every structure
/// whose gateway admits them; observers may only read; all other access is denied.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Name of the fleet
    fleet: StructureName,
    /// Names of its structures
    #[arg(required = true, value_name = "STRUCTURE")]
    structures: Vec<StructureName>,
    #[command(flatten)]
    common: Common,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { fleet, structures, common } = arguments;
    common.check_endpoints()?;
    check_name(fleet, structures)?;
    let (structures, people) = (structures.iter().cloned().collect(), common.people()?);
    let fleet = Fleet { name: fleet.clone(), structures, people };
    common.print_router(&comment(&fleet), rules::of_fleet(&fleet), None)
}

/// Rejects a fleet with a structure's name: their certificates would have the same names.
fn check_name(fleet: &StructureName, structures: &[StructureName]) -> Result<(), Failure> {
    if structures.contains(fleet) {
        return Err(Failure::usage(format!(
            "`{fleet}` is the name of a structure; give the fleet another name"
        )));
    }
    Ok(())
}

fn comment(fleet: &Fleet) -> String {
    let Fleet { name, structures, people } = fleet;
    let operators = named("operator", &people.operators);
    let observers = named("observer", &people.observers);
    let structures = named("structure", structures);
    format!(
        "// Zenoh settings of the router of the fleet `{name}`: mutual TLS and access control. Made by\n\
         // `trusswatch pki fleet`; run that again instead of editing the rules. {structures};\n\
         // {operators}; {observers}. Certificates and endpoints are given by `--tls` and `--listen`."
    )
}
