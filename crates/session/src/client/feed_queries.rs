//! What the feed of events receives, and asks modules for.

use std::time::Duration;

use vocabulary::{HistoryPage, HistoryQuestion, Key, StructureName, Topic, keys::Watched};
use zenoh::Session;
use zenoh::sample::{Sample, SampleKind};

use crate::client::request;
use observer::feed::{self, Incoming, ModuleAnswer, ModuleKey, ModuleQuery};

/// Timeout of a query.
const WITHIN: Duration = Duration::from_secs(1);
/// Replies to one query that are read.
const REPLIES: usize = 65_536;

/// Decodes a published message or the reply to a query.
pub(super) fn message(sample: &Sample) -> Option<Incoming> {
    feed::message(sample.key_expr().as_str(), &sample.payload().to_bytes())
}

/// Decodes a change of liveliness.
pub(super) fn token(sample: &Sample) -> Option<Incoming> {
    feed::token(sample.key_expr().as_str(), sample.kind() == SampleKind::Put)
}

/// Asks one module.
pub(super) async fn ask(session: Session, (key, query): (ModuleKey, ModuleQuery)) -> ModuleAnswer {
    match query {
        ModuleQuery::Present => {
            let watched = Watched { structure: Some(&key.0), module: Some(&key.1) };
            let replies = present(&session, watched).await;
            ModuleAnswer::Present(Some(key), replies)
        }
        ModuleQuery::History(since) => {
            let page = page(&session, &key, since).await;
            ModuleAnswer::Page(key, since, page)
        }
    }
}

/// Sends the first query, to all modules.
pub(super) async fn ask_all(session: Session, structure: Option<StructureName>) -> ModuleAnswer {
    let watched = Watched { structure: structure.as_ref(), module: None };
    ModuleAnswer::Present(None, present(&session, watched).await)
}

/// Queries the present states, identifications and phases; returns those of the modules that answer.
async fn present(session: &Session, watched: Watched<'_>) -> Vec<Incoming> {
    let (states, identifications, phases) = tokio::join!(
        replies(session, watched.faults()),
        replies(session, watched.identifications()),
        replies(session, watched.phases()),
    );
    states.into_iter().chain(identifications).chain(phases).collect()
}

async fn replies(session: &Session, expression: String) -> Vec<Incoming> {
    let mut incoming = Vec::new();
    let Ok(replies) = request::ask_all(session, expression, WITHIN).await else { return incoming };
    while let Ok(reply) = replies.recv_async().await {
        if incoming.len() < REPLIES
            && let Ok(sample) = reply.result()
        {
            incoming.extend(message(sample));
        }
    }
    incoming
}

async fn page(
    session: &Session,
    (structure, module): &ModuleKey,
    since: u64,
) -> Result<HistoryPage, String> {
    let key = Key::of_module(structure, module, Topic::History);
    let parameters = HistoryQuestion::since(since).to_parameters();
    let page: HistoryPage = request::ask(session, &key, &parameters, WITHIN)
        .await
        .map_err(|error| error.to_string())?;
    if page.structure != *structure || page.module != *module {
        return Err("the page belongs to another module".to_owned());
    }
    Ok(page)
}
