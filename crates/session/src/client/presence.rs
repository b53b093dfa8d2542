//! Finds running processes by their liveliness tokens, which each process declares last.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use tokio::time::{Instant, timeout_at};
use vocabulary::{
    Key, ModuleName, StructureName,
    keys::{PLANT, Watched},
};
use zenoh::Session;
use zenoh::sample::SampleKind;

/// How long to wait, after all modules were found, for a module of the same name in another structure. A second query
/// of the tokens would not help: Zenoh answers the client of a peer from the tokens received so far.
const NAMESAKES_WITHIN: Duration = Duration::from_millis(500);

/// Not every process was found.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AttendanceError {
    /// Processes that were not found in time.
    #[error("not seen within {waited:?}: {}", missing.join(", "))]
    Missing {
        /// Their names; the plant is `plant`.
        missing: Vec<String>,
        /// How long the caller waited for them.
        waited: Duration,
    },
    /// The network refused.
    #[error("liveliness cannot be watched: {0}")]
    Network(String),
}

/// Waits for the liveliness tokens of these diagnosers, and of the plant if `plant` is set. Processes declare their
/// token last.
///
/// # Errors
/// Lists the missing processes after `timeout`.
pub async fn wait_for(
    session: &Session,
    structure: &StructureName,
    modules: &[ModuleName],
    plant: bool,
    timeout: Duration,
) -> Result<(), AttendanceError> {
    let plant = plant.then(|| PLANT.to_owned());
    let mut missing: Vec<String> = modules.iter().map(ToString::to_string).chain(plant).collect();
    let found = find(session, Some(structure), &missing, timeout).await?;
    missing.retain(|name| !found.contains_key(name));
    if missing.is_empty() {
        return Ok(());
    }
    Err(AttendanceError::Missing { missing, waited: timeout })
}

/// Finds the structures of these modules. Waits until each module was found in one structure, then briefly for modules
/// of the same name in other structures unless `structure` is given, at most for `timeout`. Modules that were not found
/// are left out.
///
/// # Errors
/// Zenoh cannot declare the subscriber.
pub async fn homes(
    session: &Session,
    structure: Option<&StructureName>,
    modules: &[ModuleName],
    timeout: Duration,
) -> Result<BTreeMap<ModuleName, BTreeSet<StructureName>>, AttendanceError> {
    let wanted: Vec<String> = modules.iter().map(ToString::to_string).collect();
    let mut found = find(session, structure, &wanted, timeout).await?;
    let home = |module: &ModuleName| Some((module.clone(), found.remove(module.as_str())?));
    Ok(modules.iter().filter_map(home).collect())
}

/// Finds the structures that have a simulated plant. Waits for one like [`homes`]; empty if none was found.
///
/// # Errors
/// Zenoh cannot declare the subscriber.
pub async fn plants(
    session: &Session,
    structure: Option<&StructureName>,
    timeout: Duration,
) -> Result<BTreeSet<StructureName>, AttendanceError> {
    let mut found = find(session, structure, &[PLANT.to_owned()], timeout).await?;
    Ok(found.remove(PLANT).unwrap_or_default())
}

/// The structures of each of these processes, by name; `plant` is the plant.
async fn find(
    session: &Session,
    structure: Option<&StructureName>,
    wanted: &[String],
    timeout: Duration,
) -> Result<BTreeMap<String, BTreeSet<StructureName>>, AttendanceError> {
    let refused = |error: zenoh::Error| AttendanceError::Network(error.to_string());
    let expression = Watched { structure, module: None }.tokens();
    let liveliness = session.liveliness();
    let tokens = liveliness.declare_subscriber(&expression).history(true).await.map_err(refused)?;
    let mut found: BTreeMap<String, BTreeSet<StructureName>> = BTreeMap::new();
    let end = Instant::now() + timeout;
    let mut until = end;
    while let Ok(Ok(token)) = timeout_at(until, tokens.recv_async()).await {
        let (name, structure_of) = match token.key_expr().as_str().parse() {
            Ok(Key::Module { structure, module, .. }) => (module.to_string(), structure),
            Ok(Key::Plant { structure, .. }) => (PLANT.to_owned(), structure),
            Err(_) => continue,
        };
        if !wanted.contains(&name) {
            continue;
        }
        let structures = found.entry(name.clone()).or_default();
        match token.kind() {
            SampleKind::Put => drop(structures.insert(structure_of)),
            SampleKind::Delete => drop(structures.remove(&structure_of)),
        }
        if structures.is_empty() {
            found.remove(&name);
        }
        until = match structure {
            _ if wanted.iter().any(|name| !found.contains_key(name)) => end,
            // With a given structure there are no others to wait for.
            Some(_) => Instant::now(),
            None => until.min(Instant::now() + NAMESAKES_WITHIN),
        };
    }
    Ok(found)
}
