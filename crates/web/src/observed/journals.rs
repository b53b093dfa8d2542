//! The recent part of a module's journal.

use std::sync::Arc;

use observer::{ModuleHistory, ModuleView, QueryError};

use super::Observed;

/// Most transitions shown of a module; `trusswatch history` shows all.
const LATEST: u64 = 2000;

impl Observed {
    /// The latest entries of a module's journal; `None` for a module that is only expected and whose structure is not
    /// known. A module that is not heard is not asked.
    pub(crate) async fn journal(&self, module: &ModuleView) -> Option<Arc<ModuleHistory>> {
        let structure = module.structure.as_ref()?;
        let next = module.status.as_ref().map_or(1, |status| status.next_sequence);
        let since = next.saturating_sub(LATEST).max(1);
        let none = |why: &str| {
            let broken_off = Some(QueryError::NotAsked(why.to_owned()));
            let none = ModuleHistory::new(structure, &module.module, since);
            Some(Arc::new(ModuleHistory { broken_off, ..none }))
        };
        if let Some(why) = module.why_unheard() {
            return none(why);
        }
        let Some(session) = self.session() else { return none("the network is not connected") };
        let history =
            || observer::history(&session, structure, &module.module, since, self.timeout);
        let fetch = || async { Arc::new(history().await) };
        Some(self.journals.get((structure.clone(), module.module.clone()), fetch).await)
    }
}
