//! Which structure a command is meant for.

use std::collections::{BTreeMap, BTreeSet};

use vocabulary::{ModuleName, StructureName};
use zenoh::Session;

use super::subject::Subject;
use crate::failure::Failure;
use crate::link::{self, Target};

/// The structure of each module; those that are not there are left out. A module that is there in
/// several structures is not guessed at.
pub(super) async fn homes(
    session: &Session,
    target: &Target,
    subjects: &[Subject],
) -> Result<BTreeMap<ModuleName, StructureName>, Failure> {
    let modules: BTreeSet<ModuleName> =
        subjects.iter().map(|subject| subject.module().clone()).collect();
    let modules: Vec<ModuleName> = modules.into_iter().collect();
    let (structure, timeout) = (target.structure.as_ref(), target.timeout);
    let seen = observer::homes(session, structure, &modules, timeout).await;
    let seen = seen.map_err(link::refused)?;
    seen.into_iter().filter_map(|(module, seen)| only(module, seen).transpose()).collect()
}

fn only(
    module: ModuleName,
    mut seen: BTreeSet<StructureName>,
) -> Result<Option<(ModuleName, StructureName)>, Failure> {
    if seen.len() > 1 {
        let names: Vec<String> = seen.iter().map(|name| format!("`{name}`")).collect();
        let names = names.join(" and ");
        return Err(Failure::usage(format!(
            "`{module}` is there in {names}; say which with --structure"
        )));
    }
    Ok(seen.pop_first().map(|structure| (module, structure)))
}
