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
    #[error("not there after {waited:?}: {}", missing.join(", "))]
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
    let name = |key: Key| match key {
        Key::Module { structure, module, .. } => Some((module.to_string(), structure)),
        Key::Plant { structure, .. } => Some((PLANT.to_owned(), structure)),
    };
    let plant = plant.then(|| PLANT.to_owned());
    let mut missing: Vec<String> = modules.iter().map(ToString::to_string).chain(plant).collect();
    let found = find(session, Some(structure), Homes::of(&missing, name), timeout).await?;
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
    let name = |key: Key| match key {
        Key::Module { structure, module, .. } => Some((module, structure)),
        Key::Plant { .. } => None,
    };
    find(session, structure, Homes::of(modules, name), timeout).await
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
    let name = |key: Key| match key {
        Key::Plant { structure, .. } => Some(((), structure)),
        Key::Module { .. } => None,
    };
    let mut found = find(session, structure, Homes::of(&[()], name), timeout).await?;
    Ok(found.remove(&()).unwrap_or_default())
}

async fn find<N: Ord + Clone, F: Fn(Key) -> Option<(N, StructureName)>>(
    session: &Session,
    structure: Option<&StructureName>,
    mut homes: Homes<'_, N, F>,
    timeout: Duration,
) -> Result<BTreeMap<N, BTreeSet<StructureName>>, AttendanceError> {
    let refused = |error: zenoh::Error| AttendanceError::Network(error.to_string());
    let expression = Watched { structure, module: None }.tokens();
    let liveliness = session.liveliness();
    let tokens = liveliness.declare_subscriber(&expression).history(true).await.map_err(refused)?;
    let end = Instant::now() + timeout;
    let mut until = end;
    while let Ok(Ok(token)) = timeout_at(until, tokens.recv_async()).await {
        homes.note(token.key_expr().as_str(), token.kind() == SampleKind::Put);
        if homes.are_complete() {
            // With a given structure there are no others to wait for.
            let hold = structure.map_or(NAMESAKES_WITHIN, |_| Duration::ZERO);
            until = until.min(Instant::now() + hold);
        } else {
            until = end;
        }
    }
    Ok(homes.found)
}

/// Which of the wanted processes were found, and in which structures.
struct Homes<'a, N, F> {
    wanted: &'a [N],
    /// Extracts the name and the structure from a token's key.
    name: F,
    found: BTreeMap<N, BTreeSet<StructureName>>,
}

impl<'a, N: Ord + Clone, F: Fn(Key) -> Option<(N, StructureName)>> Homes<'a, N, F> {
    fn of(wanted: &'a [N], name: F) -> Self {
        Self { wanted, name, found: BTreeMap::new() }
    }

    fn are_complete(&self) -> bool {
        self.wanted.iter().all(|name| self.found.contains_key(name))
    }

    fn note(&mut self, key: &str, there: bool) {
        let named = key.parse::<Key>().ok().and_then(&self.name);
        let Some((name, structure)) = named else { return };
        if !self.wanted.contains(&name) {
            return;
        }
        let structures = self.found.entry(name.clone()).or_default();
        if there {
            structures.insert(structure);
        } else {
            structures.remove(&structure);
        }
        if structures.is_empty() {
            self.found.remove(&name);
        }
    }
}
