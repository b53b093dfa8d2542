//! Freeze frames: what was seen around the latching of each of the latest faults, kept beside the journal and given in
//! reply to queries (`{module}/freeze-frame`). One thread keeps and answers; nothing waits for it, so a disk that fails or
//! hangs holds up no fault.
//!
//! | file | job |
//! |---|---|
//! | `store` | which frames are kept, how many at most, which goes first |
//! | `files` | their files |

mod files;
mod store;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Instant;

use diagnosis::messages::Speaker;
use shell::clock;
use shell::supervision::{Crew, Ended};
use vocabulary::Occurrences;
use vocabulary::{Component, FreezeFrame, FreezeFrameQuestion, FrozenSignals, Topic};
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::answer::SharedInquiryCounters;
use crate::messages::{TOO_MANY_QUESTIONS, put, refuse};
use files::FreezeFrameFiles;
use store::{FreezeFrameStore, NONE};

/// Frames that may wait; a module has fewer components.
const MAX_FRAMES: usize = 48;
/// Questions that may wait.
const MAX_QUESTIONS: usize = 16;

/// Hands over frames and questions without waiting.
#[derive(Debug, Clone)]
pub(crate) struct FreezeFrames {
    queue: SyncSender<FreezeFrameWork>,
    /// Questions in the queue, so that they leave room for frames.
    questions: Arc<AtomicUsize>,
    lost: Arc<Occurrences>,
}

#[derive(Debug)]
enum FreezeFrameWork {
    Keep(Component, Box<FrozenSignals>),
    Answer(FreezeFrameQuestion, Query),
}

impl FreezeFrames {
    /// Starts the thread, which begins with what is in the state directory. It ends when every copy of this is gone.
    ///
    /// # Errors
    /// The system has no thread.
    pub(crate) fn start(
        speaker: &Speaker,
        directory: Option<PathBuf>,
        inquiries: &SharedInquiryCounters,
        crew: &Crew,
    ) -> std::io::Result<(Self, Ended)> {
        let (queue, work) = sync_channel(MAX_FRAMES + MAX_QUESTIONS);
        let questions = Arc::new(AtomicUsize::new(0));
        let (speaker, inquiries) = (speaker.clone(), Arc::clone(inquiries));
        let thread = FreezeFrameThread { speaker, inquiries, questions: Arc::clone(&questions) };
        // Not under supervision: a hung disk must not end the process.
        let ended = crew.thread("freeze frames", move |_| thread.run(directory, &work))?;
        Ok((Self { queue, questions, lost: Arc::default() }, ended))
    }

    /// Declares the queryable.
    ///
    /// # Errors
    /// The network refuses.
    pub(crate) async fn declare(
        &self,
        session: &Session,
        speaker: &Speaker,
        inquiries: &SharedInquiryCounters,
    ) -> zenoh::Result<Queryable<()>> {
        let (frames, inquiries) = (self.clone(), Arc::clone(inquiries));
        session
            .declare_queryable(speaker.key(Topic::FreezeFrame))
            .complete(true)
            .callback(move |query| frames.take(query, &inquiries))
            .await
    }

    fn take(&self, query: Query, inquiries: &SharedInquiryCounters) {
        inquiries.count(|counters| counters.received += 1);
        match FreezeFrameQuestion::from_parameters(query.parameters().as_str()) {
            Ok(question) => {
                if let Some(query) = self.ask(question, query) {
                    inquiries.count(|counters| counters.turned_away += 1);
                    refuse(&query, TOO_MANY_QUESTIONS.to_owned());
                }
            }
            Err(error) => {
                inquiries.count(|counters| counters.malformed += 1);
                refuse(&query, error.to_string());
            }
        }
    }

    /// Hands in a frame.
    pub(crate) fn keep(&self, component: Component, signals: Box<FrozenSignals>) {
        if let Err(TrySendError::Full(FreezeFrameWork::Keep(component, _))) =
            self.queue.try_send(FreezeFrameWork::Keep(component, signals))
            && let Some(times) = self.lost.note(Instant::now())
        {
            tracing::warn!(%component, times, "freeze frame dropped: disk too slow");
        }
    }

    /// Hands in a question; returns its query if too many are waiting.
    fn ask(&self, question: FreezeFrameQuestion, query: Query) -> Option<Query> {
        if self.questions.fetch_add(1, Ordering::AcqRel) >= MAX_QUESTIONS {
            self.questions.fetch_sub(1, Ordering::AcqRel);
            return Some(query);
        }
        match self.queue.try_send(FreezeFrameWork::Answer(question, query)) {
            Err(
                TrySendError::Full(FreezeFrameWork::Answer(_, query))
                | TrySendError::Disconnected(FreezeFrameWork::Answer(_, query)),
            ) => {
                self.questions.fetch_sub(1, Ordering::AcqRel);
                Some(query)
            }
            _ => None,
        }
    }
}

/// What the thread owns.
struct FreezeFrameThread {
    speaker: Speaker,
    inquiries: SharedInquiryCounters,
    questions: Arc<AtomicUsize>,
}

impl FreezeFrameThread {
    fn run(&self, directory: Option<PathBuf>, work: &Receiver<FreezeFrameWork>) {
        let files = directory.map(|directory| FreezeFrameFiles::of(&directory));
        let mut store = FreezeFrameStore::open(files, &self.speaker);
        while let Ok(work) = work.recv() {
            match work {
                FreezeFrameWork::Keep(component, signals) => {
                    let time_unix_ns = clock::unix_ns();
                    store.keep(self.speaker.freeze_frame(&component, *signals, time_unix_ns));
                }
                FreezeFrameWork::Answer(question, query) => {
                    self.questions.fetch_sub(1, Ordering::AcqRel);
                    answer(&self.speaker, &store, question, &query, &self.inquiries);
                }
            }
        }
    }
}

/// Replies with the frame that is asked for, or with every one that is kept, without its signals.
fn answer(
    speaker: &Speaker,
    store: &FreezeFrameStore,
    question: FreezeFrameQuestion,
    query: &Query,
    inquiries: &SharedInquiryCounters,
) {
    let found = match question.transition {
        Some(sequence) => store.frame(sequence).map(|frame| vec![frame]),
        None => Ok(store.heads().cloned().collect()),
    };
    match found {
        Ok(frames) if frames.is_empty() => {
            inquiries.count(|counters| counters.refused += 1);
            refuse(query, NONE.to_owned());
        }
        Ok(frames) => {
            inquiries.count(|counters| counters.answered += 1);
            frames.iter().for_each(|frame| reply(speaker, query, frame));
        }
        Err(reason) => {
            inquiries.count(|counters| counters.refused += 1);
            refuse(query, reason);
        }
    }
}

/// On the module's own key, for queries to every module at once.
fn reply(speaker: &Speaker, query: &Query, frame: &FreezeFrame) {
    put(frame, |bytes| {
        let key = speaker.key(Topic::FreezeFrame);
        query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait()
    });
}
