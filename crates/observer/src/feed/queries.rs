//! Queries to modules, and what they reply.

use std::time::Duration;

use vocabulary::{HistoryPage, HistoryQuestion, Key, Topic, keys::Watched};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget};

use super::continuity::Whose;
use super::line::Wish;
use super::reading::{Arrival, message};
use crate::request::{self, Question};

/// How long an answer may take.
const WITHIN: Duration = Duration::from_secs(1);
/// Replies to one question that are looked at.
const REPLIES: usize = 65_536;

/// What came of a question.
#[derive(Debug)]
pub(super) enum Answer {
    /// What is known at present, of one module or of all.
    Present(Option<Whose>, Vec<Arrival>),
    /// A page of a module's journal from a sequence number on, or why there is none.
    Page(Whose, u64, Result<HistoryPage, String>),
}

/// Puts a question to one module.
pub(super) async fn ask(session: Session, (whose, wish): (Whose, Wish)) -> Answer {
    match wish {
        Wish::Present => {
            let watched =
                Watched { structure: Some(&whose.structure), module: Some(&whose.module) };
            let arrivals = present(&session, watched).await;
            Answer::Present(Some(whose), arrivals)
        }
        Wish::History(since) => {
            let page = page(&session, &whose, since).await;
            Answer::Page(whose, since, page)
        }
    }
}

/// States, identifications and phases at present. Who does not answer is not among them.
pub(super) async fn present(session: &Session, watched: Watched<'_>) -> Vec<Arrival> {
    let (states, identifications, phases) = tokio::join!(
        replies(session, watched.faults()),
        replies(session, watched.identifications()),
        replies(session, watched.phases()),
    );
    states.into_iter().chain(identifications).chain(phases).collect()
}

async fn replies(session: &Session, expression: String) -> Vec<Arrival> {
    let query = session
        .get(expression)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(WITHIN);
    let mut arrivals = Vec::new();
    let Ok(replies) = query.await else { return arrivals };
    while let Ok(reply) = replies.recv_async().await {
        if arrivals.len() < REPLIES
            && let Ok(sample) = reply.result()
        {
            arrivals.extend(message(sample));
        }
    }
    arrivals
}

async fn page(session: &Session, whose: &Whose, since: u64) -> Result<HistoryPage, String> {
    let key = Key::of_module(&whose.structure, &whose.module, Topic::History);
    let question = Question::of_parameters(HistoryQuestion::since(since).to_parameters());
    let page: HistoryPage =
        request::ask(session, &key, question, WITHIN).await.map_err(|error| error.to_string())?;
    if page.structure != whose.structure || page.module != whose.module {
        return Err("the page is another module's".to_owned());
    }
    Ok(page)
}
