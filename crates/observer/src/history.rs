//! A module's journal over the network, page by page.

use std::time::Duration;

use vocabulary::{HistoryQuestion, Key, ModuleName, StructureName, Topic};
use zenoh::Session;

use super::request::{Question, ask};
use super::view::ModuleHistory;

/// Reads a module's journal from the sequence number `since` on. Every page may take as long as
/// `timeout`. What was read before a page failed is kept.
pub async fn history(
    session: &Session,
    structure: &StructureName,
    module: &ModuleName,
    since: u64,
    timeout: Duration,
) -> ModuleHistory {
    let key = Key::of_module(structure, module, Topic::History);
    let mut history = ModuleHistory::new(structure, module, since);
    let mut next = Some(since);
    while let Some(asked) = next {
        let question = Question::of_parameters(HistoryQuestion::since(asked).to_parameters());
        let page = ask(session, &key, question, timeout).await;
        match page.and_then(|page| history.take(asked, page)) {
            Ok(following) => next = following,
            Err(error) => {
                history.broken_off = Some(error);
                return history;
            }
        }
    }
    history
}
