//! Who is there: liveliness tokens, which processes declare last of all.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use tokio::time::{Instant, timeout_at};
use vocabulary::{
    Key, ModuleName, StructureName,
    keys::{PLANT, Watched},
};
use zenoh::Session;
use zenoh::sample::SampleKind;

/// How long after everyone was seen another structure's module of the same name may still show up. Querying
/// the tokens once more would not do: Zenoh answers the client of a peer from what has come so far.
const NAMESAKES_WITHIN: Duration = Duration::from_millis(500);

/// Not everyone came.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AttendanceError {
    /// Those who were not seen in time.
    #[error("not there after {waited:?}: {}", missing.join(", "))]
    Missing {
        /// Their names; the plant is `plant`.
        missing: Vec<String>,
        /// How long they were waited for.
        waited: Duration,
    },
    /// The network refused.
    #[error("liveliness cannot be watched: {0}")]
    Network(String),
}

/// Waits until these diagnosers are there, and the plant if `plant` says so: their liveliness tokens,
/// which they declare last of all.
///
/// # Errors
/// Who is missing when time is up.
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

/// Of which structures these modules are. Waits until each of them has been seen in one, and a little for
/// others of the same name unless `structure` says which one is meant, but not longer than `timeout`; a
/// module that was not seen by then is left out.
///
/// # Errors
/// The network refuses.
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

/// Which structures have a simulated plant. Waits for one like [`homes`]; empty if none was seen.
///
/// # Errors
/// The network refuses.
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
            // With a structure given there is nothing else to come.
            let hold = structure.map_or(NAMESAKES_WITHIN, |_| Duration::ZERO);
            until = until.min(Instant::now() + hold);
        } else {
            until = end;
        }
    }
    Ok(homes.found)
}

/// Which of the wanted were seen, and where.
struct Homes<'a, N, F> {
    wanted: &'a [N],
    /// Who has this token, and in which structure.
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
