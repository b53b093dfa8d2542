//! The thread that keeps freeze frames and answers questions for them, and its queue.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Instant;

use diagnosis::messages::Speaker;
use shell::clock;
use shell::occurrences::Occurrences;
use shell::supervision::{Crew, Ended};
use vocabulary::FreezeFrameQuestion;
use zenoh::query::Query;

use super::album::Album;
use super::folder::Folder;
use super::question::answer;
use crate::diagnoser::inquiry::InquiryTally;

/// Frames that may wait; a module has fewer components.
const MAX_FRAMES: usize = 48;
/// Questions that may wait.
const MAX_QUESTIONS: usize = 16;

/// Hands over frames and questions without waiting.
#[derive(Debug, Clone)]
pub(crate) struct FreezeFrames {
    queue: SyncSender<Work>,
    /// Questions in the queue, so that they leave room for frames.
    questions: Arc<AtomicUsize>,
    lost: Arc<Occurrences>,
}

#[derive(Debug)]
enum Work {
    Keep(Box<diagnosis::FreezeFrame>),
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
        inquiries: &Arc<InquiryTally>,
        crew: &Crew,
    ) -> std::io::Result<(Self, Ended)> {
        let (queue, work) = sync_channel(MAX_FRAMES + MAX_QUESTIONS);
        let questions = Arc::new(AtomicUsize::new(0));
        let (speaker, inquiries) = (speaker.clone(), Arc::clone(inquiries));
        let keeper = Keeper { speaker, inquiries, questions: Arc::clone(&questions) };
        // Not under supervision: a disk that hangs is no reason to end.
        let ended = crew.thread("freeze frames", move |_| keeper.run(directory, &work))?;
        Ok((Self { queue, questions, lost: Arc::default() }, ended))
    }

    /// Hands in a frame.
    pub(crate) fn keep(&self, frame: Box<diagnosis::FreezeFrame>) {
        if let Err(TrySendError::Full(Work::Keep(frame))) = self.queue.try_send(Work::Keep(frame))
            && let Some(times) = self.lost.note(Instant::now())
        {
            let component = &frame.component;
            tracing::warn!(%component, times, "freeze frame lost: the disk takes too long");
        }
    }

    /// Hands in a question; returns its query if too many are waiting.
    pub(super) fn ask(&self, question: FreezeFrameQuestion, query: Query) -> Option<Query> {
        if self.questions.fetch_add(1, Ordering::AcqRel) >= MAX_QUESTIONS {
            self.questions.fetch_sub(1, Ordering::AcqRel);
            return Some(query);
        }
        match self.queue.try_send(Work::Answer(question, query)) {
            Err(
                TrySendError::Full(Work::Answer(_, query))
                | TrySendError::Disconnected(Work::Answer(_, query)),
            ) => {
                self.questions.fetch_sub(1, Ordering::AcqRel);
                Some(query)
            }
            _ => None,
        }
    }
}

/// What the thread owns.
struct Keeper {
    speaker: Speaker,
    inquiries: Arc<InquiryTally>,
    questions: Arc<AtomicUsize>,
}

impl Keeper {
    fn run(&self, directory: Option<PathBuf>, work: &Receiver<Work>) {
        let folder = directory.map(|directory| Folder::of(&directory));
        let mut album = Album::open(folder, &self.speaker);
        while let Ok(work) = work.recv() {
            match work {
                Work::Keep(frame) => {
                    album.keep(self.speaker.freeze_frame(*frame, clock::unix_ns()));
                }
                Work::Answer(question, query) => {
                    self.questions.fetch_sub(1, Ordering::AcqRel);
                    answer(&self.speaker, &album, question, &query, &self.inquiries);
                }
            }
        }
    }
}
