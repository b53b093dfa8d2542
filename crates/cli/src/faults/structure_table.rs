//! Several structures as a table.

use names::StructureName;
use wire::FaultState;

use super::roll_up::RollUp;
use crate::paint::Colour;
use crate::table::{TextTable, table};

/// What stands in the place of the name of a structure that is not known.
pub(super) const NO_STRUCTURE: &str = "(no structure seen)";

const HEADING: [&str; 9] = [
    "structure",
    "modules in service",
    "not answering",
    "latched",
    "acknowledged",
    "unconfirmed",
    "unknown",
    "set aside",
    "normal and verified",
];

/// The table, and the colour of each row.
pub(super) fn structures(structures: &[RollUp<'_>]) -> (TextTable, Vec<Option<Colour>>) {
    let mut table = table(&HEADING);
    for structure in structures {
        table.add_row(row(structure));
    }
    table.align_right(1..HEADING.len());
    (table, structures.iter().map(colour).collect())
}

fn row(of: &RollUp<'_>) -> [String; 9] {
    let components: usize = of.members.iter().map(|module| module.components.len()).sum();
    [
        of.structure.map_or(NO_STRUCTURE, StructureName::as_str).to_owned(),
        format!("{} of {}", of.modules_in_service, of.modules),
        (of.modules - of.modules_answering).to_string(),
        of.latched.to_string(),
        of.acknowledged.to_string(),
        of.unconfirmed.to_string(),
        of.unknown.to_string(),
        of.set_aside.to_string(),
        format!("{} of {components}", of.verified),
    ]
}

fn colour(of: &RollUp<'_>) -> Option<Colour> {
    let urgent = of.alarms(FaultState::Latched) > 0 || of.modules_answering < of.modules;
    match (of.all_is_well, urgent) {
        (true, _) => None,
        (false, true) => Some(Colour::Red),
        (false, false) => Some(Colour::Yellow),
    }
}
