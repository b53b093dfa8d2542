//! Pages of the journal for queries, read by a thread of its own: a long journal delays nothing
//! else.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};

use shell::supervision::Crew;
use wire::{
    HistoryPage, HistoryQuestion, Identification, MAX_IDENTIFICATIONS_OF_FAULT, MAX_MESSAGE_BYTES,
    Message, Topic,
};
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::InquiryTally;
use crate::convert::Speaker;
use crate::diagnoser::state::{Entry, entries};
use crate::messages::{TOO_MANY_QUESTIONS, put, refuse};

/// Questions that may wait.
const MAX_WAITING: usize = 16;
/// A page is ended before it gets longer than this.
const PAGE_BYTES: usize = MAX_MESSAGE_BYTES / 2;

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    (directory, crew): (Option<PathBuf>, &Crew),
    counters: &Arc<InquiryTally>,
) -> zenoh::Result<Queryable<()>> {
    let queue = reader(speaker.clone(), directory, Arc::clone(counters), crew)?;
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
    crew: &Crew,
) -> std::io::Result<SyncSender<(HistoryQuestion, Query)>> {
    let (queue, out) = sync_channel::<(HistoryQuestion, Query)>(MAX_WAITING);
    crew.thread("history", move |lane| {
        while let Ok((question, query)) = out.recv() {
            lane.begin();
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

fn page(
    speaker: &Speaker,
    directory: &Path,
    question: HistoryQuestion,
) -> Result<HistoryPage, journal::ReadError> {
    let mut failed = None;
    let records = journal::read(directory)?
        .map_while(|record| record.map_err(|error| failed = Some(error)).ok());
    let page = compile(speaker, entries(records, &speaker.module), question);
    failed.map_or(Ok(page), Err)
}

/// The page of `all` entries that is asked for. `all` is read to its end: the numbers on the page say how far the
/// journal reaches, and a fault may be identified anew long after it was declared.
fn compile(
    speaker: &Speaker,
    all: impl Iterator<Item = Entry>,
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
    let mut identified = Identified::default();
    for entry in all {
        let transition = match entry {
            Entry::Transition(transition) => *transition,
            Entry::Identification(found) => {
                identified.enter(*found, question.since);
                continue;
            }
        };
        page.first_sequence.get_or_insert(transition.sequence);
        page.next_sequence = transition.sequence + 1;
        if transition.sequence < question.since || page.more {
            continue;
        }
        bytes += length(&transition);
        page.more = page.transitions.len() as u64 == question.limit || bytes > PAGE_BYTES;
        if !page.more {
            page.transitions.push(transition);
        }
    }
    identified.complete(&mut page);
    page
}

/// The latest identifications of each fault, by the number of the transition that declared it.
#[derive(Debug, Default)]
struct Identified(BTreeMap<u64, VecDeque<Identification>>);

impl Identified {
    fn enter(&mut self, found: Identification, since: u64) {
        if found.sequence < since {
            return;
        }
        let of_fault = self.0.entry(found.sequence).or_default();
        if of_fault.len() == MAX_IDENTIFICATIONS_OF_FAULT {
            of_fault.pop_front();
        }
        of_fault.push_back(found);
    }

    /// Adds to each transition of the page what belongs to it, and ends the page where it would get too long. It
    /// keeps its first transition, or the next page would be the same.
    fn complete(mut self, page: &mut HistoryPage) {
        let mut bytes = 0;
        for place in 0..page.transitions.len() {
            let transition = &page.transitions[place];
            let later = self.0.split_off(&(transition.sequence + 1));
            let found = std::mem::replace(&mut self.0, later);
            let found: Vec<Identification> = found.into_values().flatten().collect();
            bytes += length(transition) + found.iter().map(length).sum::<usize>();
            if bytes > PAGE_BYTES && place > 0 {
                page.transitions.truncate(place);
                page.more = true;
                return;
            }
            let mut room = PAGE_BYTES;
            page.identifications.extend(found.into_iter().take_while(|found| {
                room = room.saturating_sub(length(found));
                room > 0
            }));
        }
    }
}

fn length<M: Message>(message: &M) -> usize {
    wire::encode(message).map_or(0, |text| text.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::FaultTransition;

    fn speaker() -> Speaker {
        Speaker { structure: "t".parse().unwrap(), module: "m1".parse().unwrap() }
    }

    fn transition(sequence: u64) -> Entry {
        let component = "sensor/g1".parse().unwrap();
        let untouched = speaker().untouched(&component, 0);
        Entry::Transition(Box::new(FaultTransition { sequence, ..untouched }))
    }

    fn transitions(count: u64) -> impl Iterator<Item = Entry> {
        (1..=count).map(transition)
    }

    fn found(sequence: u64, as_of: u64) -> Entry {
        let kind = names::fault::FaultKind::Bias;
        let size = diagnosis::identification::Size { value: 1.0 / 3.0, low: 0.1, high: 2.0 / 3.0 };
        let candidate =
            diagnosis::identification::Candidate { kind, probability: 0.1, size: Some(size) };
        let found = diagnosis::identification::Identification {
            run: names::RunId(1),
            sequence,
            component: "sensor/g1".parse().unwrap(),
            as_of: names::Step(as_of),
            candidates: vec![candidate; 5],
            signature: Vec::new(),
        };
        Entry::Identification(Box::new(speaker().identification(found, 0)))
    }

    #[test]
    fn identifications_are_on_the_page_of_the_transition_that_declared_the_fault() {
        let all = || {
            let late = [found(2, 50), found(3, 60), found(2, 70), found(5, 80)];
            transitions(5).chain(late)
        };
        let on_page = |since, limit| {
            let page = compile(&speaker(), all(), HistoryQuestion { since, limit });
            let found = page.identifications.iter().map(|found| found.as_of_step.0);
            found.collect::<Vec<_>>()
        };
        assert_eq!(on_page(1, 2), [50, 70]);
        assert_eq!(on_page(3, 2), [60]);
        assert_eq!(on_page(5, 2), [80]);
        assert_eq!(on_page(1, 500), [50, 70, 60, 80]);
    }

    #[test]
    fn an_identification_whose_transition_is_gone_is_on_the_page_after_it() {
        let all = [transition(7), found(5, 50)].into_iter();
        let page = compile(&speaker(), all, HistoryQuestion::since(1));
        assert_eq!(page.identifications.len(), 1);
    }

    #[test]
    fn of_a_fault_that_is_identified_ever_anew_the_latest_are_shown_and_pages_go_on() {
        let all = || {
            let found = (0..5000).map(|as_of| found(as_of % 300 + 1, as_of));
            transitions(300).chain(found)
        };
        let (mut since, mut numbers, mut shown) = (1, Vec::new(), 0);
        loop {
            let page = compile(&speaker(), all(), HistoryQuestion { since, limit: 500 });
            assert!(length(&page) < MAX_MESSAGE_BYTES);
            numbers.extend(page.transitions.iter().map(|transition| transition.sequence));
            shown += page.identifications.len();
            if !page.more {
                break;
            }
            since = numbers.last().unwrap() + 1;
        }
        assert_eq!(numbers, (1..=300).collect::<Vec<_>>());
        assert_eq!(shown, 5000);
        let many = std::iter::once(transition(1)).chain((0..100).map(|as_of| found(1, as_of)));
        let page = compile(&speaker(), many, HistoryQuestion::since(1));
        let steps: Vec<u64> = page.identifications.iter().map(|found| found.as_of_step.0).collect();
        assert_eq!(steps, (68..100).collect::<Vec<_>>());
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
