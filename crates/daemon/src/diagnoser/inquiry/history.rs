//! Pages of the journal for queries, read by a thread of its own: a long journal delays nothing
//! else.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};

use wire::{FaultTransition, HistoryPage, HistoryQuestion, MAX_MESSAGE_BYTES, Topic};
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::InquiryTally;
use crate::convert::Speaker;
use crate::diagnoser::state::transitions;
use crate::messages::{TOO_MANY_QUESTIONS, put, refuse};

/// Questions that may wait.
const MAX_WAITING: usize = 16;
/// A page is ended before it gets longer than this.
const PAGE_BYTES: usize = MAX_MESSAGE_BYTES / 2;

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    directory: Option<PathBuf>,
    counters: &Arc<InquiryTally>,
) -> zenoh::Result<Queryable<()>> {
    let queue = reader(speaker.clone(), directory, Arc::clone(counters))?;
    let counters = Arc::clone(counters);
    session
        .declare_queryable(speaker.key(Topic::History))
        .complete(true)
        .callback(move |query| take(query, &queue, &counters))
        .await
}

fn take(query: Query, queue: &SyncSender<(HistoryQuestion, Query)>, counters: &InquiryTally) {
    counters.received();
    match HistoryQuestion::from_parameters(query.parameters().as_str()) {
        Ok(question) => {
            if let Err(error) = queue.try_send((question, query)) {
                counters.turned_away();
                let (_, query) = match error {
                    std::sync::mpsc::TrySendError::Full(back)
                    | std::sync::mpsc::TrySendError::Disconnected(back) => back,
                };
                refuse(&query, TOO_MANY_QUESTIONS.to_owned());
            }
        }
        Err(error) => {
            counters.malformed();
            refuse(&query, error.to_string());
        }
    }
}

/// Starts the thread; it ends when every sender is gone.
fn reader(
    speaker: Speaker,
    directory: Option<PathBuf>,
    counters: Arc<InquiryTally>,
) -> std::io::Result<SyncSender<(HistoryQuestion, Query)>> {
    let (queue, out) = sync_channel::<(HistoryQuestion, Query)>(MAX_WAITING);
    std::thread::Builder::new().name("history".to_owned()).spawn(move || {
        while let Ok((question, query)) = out.recv() {
            let found = match &directory {
                None => Err("this diagnoser keeps no journal; give it a state directory".into()),
                Some(directory) => {
                    page(&speaker, directory, question).map_err(|error| error.to_string())
                }
            };
            match found {
                Ok(page) => {
                    counters.answered();
                    reply(&speaker, &query, &page);
                }
                Err(reason) => {
                    counters.refused();
                    refuse(&query, reason);
                }
            }
        }
    })?;
    Ok(queue)
}

/// Replies on the module's own key, for queries to every module at once: of replies with the same key a
/// client shows one.
fn reply(speaker: &Speaker, query: &Query, page: &HistoryPage) {
    put(page, |bytes| {
        let key = speaker.key(Topic::History);
        query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait()
    });
}

fn page(
    speaker: &Speaker,
    directory: &Path,
    question: HistoryQuestion,
) -> Result<HistoryPage, journal::ReadError> {
    let mut failed = None;
    let records = journal::read(directory)?
        .map_while(|record| record.map_err(|error| failed = Some(error)).ok());
    let page = compile(speaker, transitions(records, &speaker.module), question);
    failed.map_or(Ok(page), Err)
}

/// The page of `all` transitions that is asked for. `all` is read to its end: the numbers on the page
/// say how far the journal reaches.
fn compile(
    speaker: &Speaker,
    all: impl Iterator<Item = FaultTransition>,
    question: HistoryQuestion,
) -> HistoryPage {
    let mut page = HistoryPage {
        structure: speaker.structure.clone(),
        module: speaker.module.clone(),
        transitions: Vec::new(),
        identifications: Vec::new(),
        first_sequence: None,
        next_sequence: 1,
        more: false,
    };
    let mut bytes = 0;
    for transition in all {
        page.first_sequence.get_or_insert(transition.sequence);
        page.next_sequence = transition.sequence + 1;
        if transition.sequence < question.since || page.more {
            continue;
        }
        bytes += wire::encode(&transition).map_or(0, |text| text.len());
        page.more = page.transitions.len() as u64 == question.limit || bytes > PAGE_BYTES;
        if !page.more {
            page.transitions.push(transition);
        }
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    fn speaker() -> Speaker {
        Speaker { structure: "t".parse().unwrap(), module: "m1".parse().unwrap() }
    }

    fn transitions(count: u64) -> impl Iterator<Item = FaultTransition> {
        (1..=count).map(|sequence| {
            let component = "sensor/g1".parse().unwrap();
            FaultTransition { sequence, ..speaker().untouched(&component, 0) }
        })
    }

    #[test]
    fn pages_follow_each_other_without_a_gap() {
        let mut since = 1;
        let mut read_back = Vec::new();
        loop {
            let question = HistoryQuestion { since, limit: 7 };
            let page = compile(&speaker(), transitions(20), question);
            assert_eq!((page.first_sequence, page.next_sequence), (Some(1), 21));
            read_back.extend(page.transitions.iter().map(|t| t.sequence));
            if !page.more {
                break;
            }
            since = read_back.last().unwrap() + 1;
        }
        assert_eq!(read_back, (1..=20).collect::<Vec<_>>());
    }

    #[test]
    fn a_page_is_never_longer_than_a_message_may_be() {
        let page =
            compile(&speaker(), transitions(5000), HistoryQuestion { since: 1, limit: 5000 });
        assert!(page.more && !page.transitions.is_empty());
        assert!(wire::encode(&page).unwrap().len() < MAX_MESSAGE_BYTES);
    }

    #[test]
    fn an_empty_journal_has_an_empty_page() {
        let page = compile(&speaker(), transitions(0), HistoryQuestion::since(1));
        assert_eq!((page.first_sequence, page.next_sequence, page.more), (None, 1, false));
    }
}
