//! What a module's journal holds, as far as a page shows it.

use std::sync::Arc;
use std::time::Duration;

use names::{ModuleName, StructureName};
use observer::{LiveModule, ModuleHistory};
use zenoh::Session;

use super::answers::Answers;

/// Transitions that are shown of a module; `trusswatch history` shows all.
const LATEST: u64 = 2000;
const KEEP: Duration = Duration::from_secs(2);

/// The latest of a module's journal, or why there is nothing.
#[derive(Debug, Clone)]
pub(crate) struct Journal {
    pub(crate) module: ModuleName,
    pub(crate) since: u64,
    pub(crate) read: Result<Arc<ModuleHistory>, String>,
}

/// Those of all modules.
#[derive(Debug)]
pub(crate) struct Journals(Answers<(StructureName, ModuleName), Journal>);

impl Default for Journals {
    fn default() -> Self {
        Self(Answers::new(KEEP))
    }
}

impl Journals {
    /// The latest of a module's journal. A module that is not heard is not asked.
    pub(crate) async fn of(
        &self,
        session: Option<Session>,
        timeout: Duration,
        module: &LiveModule,
    ) -> Journal {
        let member = &module.picture.member;
        let status = member.status.as_ref();
        let next = status.map_or(1, |status| status.next_sequence);
        let since = next.saturating_sub(LATEST).max(1);
        let none =
            |why: &str| Journal { module: member.module.clone(), since, read: Err(why.to_owned()) };
        let Some(structure) = &member.structure else { return none("it is not heard") };
        if module.silent_since_unix_ns.is_some() {
            return none("it is not heard");
        }
        let Some(session) = session else { return none("there is no network") };
        let fetch = || async {
            let history =
                observer::history(&session, structure, &member.module, since, timeout).await;
            match (&history.broken_off, history.answered()) {
                (Some(error), false) => none(&error.to_string()),
                _ => Journal { read: Ok(Arc::new(history)), ..none("") },
            }
        };
        self.0.get((structure.clone(), member.module.clone()), fetch).await
    }
}

impl Journal {
    /// What is missing from it, in words.
    pub(crate) fn notes(&self) -> Vec<String> {
        let module = &self.module;
        let history = match &self.read {
            Ok(history) => history,
            Err(why) => return vec![format!("{module}: {why}; nothing is known of its history")],
        };
        let mut notes = Vec::new();
        if self.since > 1 {
            notes.push(format!(
                "{module}: transitions before {} are not shown here; `trusswatch history` shows all",
                self.since
            ));
        }
        if let Some(first) = history.first_sequence.filter(|first| *first > self.since) {
            notes.push(format!("{module}: the journal reaches back to transition {first} only"));
        }
        notes.extend(history.gaps(self.since).into_iter().map(|gap| {
            format!("{module}: transitions {} to {} are missing from the journal", gap.from, gap.to)
        }));
        notes.extend(history.broken_off.as_ref().map(|error| {
            let after = history.transitions.last().map_or(0, |transition| transition.sequence);
            format!("{module}: nothing was read after transition {after}: {error}")
        }));
        notes
    }
}
