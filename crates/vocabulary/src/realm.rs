//! Key expressions that access control uses: what belongs to whom.

use crate::{ModuleName, OperatorName, StructureName};

use crate::keys::{PLANT, ROOT, Topic};

/// Everything that is published.
#[must_use]
pub fn everything() -> Vec<String> {
    below(ROOT)
}

/// Everything that is published of a structure.
#[must_use]
pub fn of_structure(structure: &StructureName) -> Vec<String> {
    below(&format!("{ROOT}/{structure}"))
}

/// What a module publishes, answers and is queried for.
#[must_use]
pub fn of_module(structure: &StructureName, module: &ModuleName) -> Vec<String> {
    below(&format!("{ROOT}/{structure}/{module}"))
}

/// What the plant publishes, answers and is queried for in its own name.
#[must_use]
pub fn of_plant(structure: &StructureName) -> Vec<String> {
    below(&format!("{ROOT}/{structure}/{PLANT}"))
}

/// The samples of a module.
#[must_use]
pub fn samples(structure: &StructureName, module: &ModuleName) -> String {
    format!("{ROOT}/{structure}/{module}/{}", Topic::Sample)
}

/// Read-only queries: present states, kinds of faults, phases, journals, past samples and inputs, configurations,
/// freeze frames.
#[must_use]
pub fn readable() -> Vec<String> {
    let topics = [
        "fault/**".to_owned(),
        "identification/**".to_owned(),
        Topic::Phase.to_string(),
        Topic::History.to_string(),
        Topic::Sample.to_string(),
        Topic::Input.to_string(),
        Topic::Configuration.to_string(),
        Topic::FreezeFrame.to_string(),
    ];
    topics.iter().map(|topic| format!("{ROOT}/*/*/{topic}")).collect()
}

/// The question that modules put to one another; it makes who is asked wait for its step.
#[must_use]
pub fn questions_of_peers(structure: &StructureName) -> String {
    format!("{ROOT}/{structure}/*/{}", Topic::State)
}

/// An operator's commands to modules, under his own name, and to the plant.
#[must_use]
pub fn commands_of(structure: &StructureName, operator: &OperatorName) -> Vec<String> {
    vec![
        format!("{ROOT}/{structure}/*/command/*/{operator}"),
        format!("{ROOT}/{structure}/{PLANT}/command/*"),
    ]
}

fn below(prefix: &str) -> Vec<String> {
    vec![format!("{prefix}/**")]
}
