//! What a module's journal holds, as far as a page shows it.

use std::sync::Arc;

use names::ModuleName;
use observer::{ModuleHistory, ModuleView};

use super::Observed;

/// Transitions that are shown of a module; `trusswatch history` shows all.
const LATEST: u64 = 2000;

/// The latest of a module's journal, or why there is nothing.
#[derive(Debug, Clone)]
pub(crate) struct Journal {
    pub(crate) module: ModuleName,
    pub(crate) since: u64,
    pub(crate) read: Result<Arc<ModuleHistory>, String>,
}

impl Observed {
    /// The latest of a module's journal. A module that is not heard is not asked.
    pub(crate) async fn journal(&self, module: &ModuleView) -> Journal {
        let status = module.status.as_ref();
        let next = status.map_or(1, |status| status.next_sequence);
        let since = next.saturating_sub(LATEST).max(1);
        let none =
            |why: &str| Journal { module: module.module.clone(), since, read: Err(why.to_owned()) };
        let Some(structure) = &module.structure else { return none("it is not heard") };
        if module.is_silent {
            return none("it is not heard");
        }
        let Some(session) = self.session() else { return none("there is no network") };
        let fetch = || async {
            let history =
                observer::history(&session, structure, &module.module, since, self.timeout).await;
            match (&history.broken_off, history.answered()) {
                (Some(error), false) => none(&error.to_string()),
                _ => Journal { read: Ok(Arc::new(history)), ..none("") },
            }
        };
        self.journals.get((structure.clone(), module.module.clone()), fetch).await
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
        let mut notes = history.notes();
        if self.since > 1 {
            notes.push(format!(
                "{module}: transitions before {} are not shown here; `trusswatch history` shows all",
                self.since
            ));
        }
        notes
    }
}
