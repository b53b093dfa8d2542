//! Reads the journals of several modules concurrently.

use observer::{ModuleHistory, ModuleView};
use serde::Serialize;
use session::client::attendance;
use tokio::task::JoinSet;
use vocabulary::{ModuleName, StructureName};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::LinkTarget;
use vocabulary::words::printable;

/// The journals read.
#[derive(Debug, Clone, Default)]
pub(super) struct JournalReading {
    /// The journals of modules that answered, by structure and name.
    pub(super) histories: Vec<ModuleHistory>,
    /// Modules that did not answer.
    pub(super) silent: Vec<SilentModule>,
}

/// A module that should have answered.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct SilentModule {
    pub(super) structure: Option<StructureName>,
    pub(super) module: ModuleName,
    pub(super) reason: String,
}

impl JournalReading {
    pub(super) fn is_of_anybody(&self) -> bool {
        !self.histories.is_empty()
    }

    /// The error if nothing was read.
    pub(super) fn nothing_read(&self, link: &LinkTarget) -> Failure {
        if self.silent.is_empty() {
            return link.no_module();
        }
        let reasons =
            self.silent.iter().map(|silent| format!("{}: {}", silent.module, silent.reason));
        Failure::networks(reasons.collect())
    }

    /// Everything that is missing, in words.
    pub(super) fn notes(&self) -> impl Iterator<Item = String> {
        let silent = self.silent.iter().map(|SilentModule { module, reason, .. }| {
            format!("{module}: {reason}; its history is unavailable")
        });
        silent.chain(self.histories.iter().flat_map(ModuleHistory::notes))
    }

    fn add(&mut self, history: ModuleHistory) {
        if history.answered() {
            self.histories.push(history);
            return;
        }
        let reason = history.broken_off.as_ref().map_or_else(String::new, ToString::to_string);
        let structure = Some(history.structure);
        self.silent.push(SilentModule {
            structure,
            module: history.module,
            reason: printable(&reason),
        });
    }
}

/// Reads the journals of these modules, or of all modules found.
pub(super) async fn read(
    session: &Session,
    link: &LinkTarget,
    named: &[ModuleName],
    since: u64,
) -> Result<JournalReading, Failure> {
    let mut reading = JournalReading::default();
    let mut tasks = JoinSet::new();
    for (module, structures) in modules_to_query(session, link, named).await? {
        if structures.is_empty() {
            let reason = format!("not seen (waited {:?})", link.timeout);
            reading.silent.push(SilentModule { structure: link.structure.clone(), module, reason });
            continue;
        }
        for structure in structures {
            let (session, module, timeout) = (session.clone(), module.clone(), link.timeout);
            tasks.spawn(async move {
                session::client::history(&session, &structure, &module, since, timeout).await
            });
        }
    }
    while let Some(done) = tasks.join_next().await {
        let history =
            done.map_err(|error| Failure::runtime(format!("a journal was not read: {error}")))?;
        reading.add(history);
    }
    let place =
        |structure: &StructureName, module: &ModuleName| (structure.clone(), module.clone());
    reading.histories.sort_by_key(|history| place(&history.structure, &history.module));
    reading.silent.sort_by(|a, b| (&a.structure, &a.module).cmp(&(&b.structure, &b.module)));
    Ok(reading)
}

/// The modules, each with the structures in which it was found; none if it is missing. Modules named as peers are
/// queried too, in case only their liveliness token is missing.
async fn modules_to_query(
    session: &Session,
    link: &LinkTarget,
    named: &[ModuleName],
) -> Result<Vec<(ModuleName, Vec<StructureName>)>, Failure> {
    let structure = link.structure.as_ref();
    if !named.is_empty() {
        let homes = session::client::homes(session, structure, named, link.timeout).await?;
        let home = |module: &ModuleName| homes.get(module).into_iter().flatten().cloned().collect();
        return Ok(named.iter().map(|module| (module.clone(), home(module))).collect());
    }
    let scene = attendance(session, structure, link.timeout).await?;
    let entry = |module: &ModuleView| {
        (module.module.clone(), module.structure.clone().into_iter().collect())
    };
    Ok(scene.modules.iter().map(entry).collect())
}
