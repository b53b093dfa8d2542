//! Pages of the journal for queries, read by a thread of its own: a long journal delays nothing
//! else, and is read once, however often it is asked for.
//!
//! | file | job |
//! |---|---|
//! | `page` | which entry of the journal is where; from there to a page, reading the entries on it and no others |
//! | `reading` | the journal's files, read as far as they reach whenever there is a question |

mod page;
mod reading;
#[cfg(test)]
mod testing;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};

use shell::supervision::Crew;
use vocabulary::{HistoryPage, HistoryQuestion, Topic};
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use reading::HistoryReader;

use super::{SharedInquiryCounters, hand_over};
use crate::messages::{put, refuse};
use diagnosis::messages::Speaker;

/// Questions that may wait.
const MAX_WAITING: usize = 16;

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    (directory, crew): (Option<PathBuf>, &Crew),
    counters: &SharedInquiryCounters,
) -> zenoh::Result<Queryable<()>> {
    let queue = reader(speaker.clone(), directory, Arc::clone(counters), crew)?;
    let counters = Arc::clone(counters);
    session
        .declare_queryable(speaker.key(Topic::History))
        .complete(true)
        .callback(move |query| {
            let question = HistoryQuestion::from_parameters(query.parameters().as_str());
            hand_over(question, query, &queue, &counters);
        })
        .await
}

/// Starts the thread; it ends when every sender is gone.
fn reader(
    speaker: Speaker,
    directory: Option<PathBuf>,
    counters: SharedInquiryCounters,
    crew: &Crew,
) -> std::io::Result<SyncSender<(HistoryQuestion, Query)>> {
    let (queue, out) = sync_channel::<(HistoryQuestion, Query)>(MAX_WAITING);
    crew.thread("history", move |lane| {
        let mut reading = directory.map(|directory| HistoryReader::new(&speaker, &directory));
        while let Ok((question, query)) = out.recv() {
            lane.begin();
            let found = match &mut reading {
                None => Err("this diagnoser keeps no journal; give it a state directory".into()),
                Some(reading) => reading.page(question).map_err(|error| error.to_string()),
            };
            match found {
                Ok(page) => {
                    counters.count(|counters| counters.answered += 1);
                    reply(&speaker, &query, &page);
                }
                Err(reason) => {
                    counters.count(|counters| counters.refused += 1);
                    refuse(&query, reason);
                }
            }
            lane.rest();
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
