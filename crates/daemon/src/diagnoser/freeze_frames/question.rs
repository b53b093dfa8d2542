//! Questions for freeze frames.

use std::sync::Arc;

use diagnosis::messages::Speaker;
use vocabulary::{FreezeFrame, FreezeFrameQuestion, Topic};
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::FreezeFrames;
use super::album::{Album, NONE};
use crate::diagnoser::inquiry::InquiryTally;
use crate::messages::{TOO_MANY_QUESTIONS, put, refuse};

impl FreezeFrames {
    /// Declares the queryable.
    ///
    /// # Errors
    /// The network refuses.
    pub(crate) async fn declare(
        &self,
        session: &Session,
        speaker: &Speaker,
        inquiries: &Arc<InquiryTally>,
    ) -> zenoh::Result<Queryable<()>> {
        let (frames, inquiries) = (self.clone(), Arc::clone(inquiries));
        session
            .declare_queryable(speaker.key(Topic::FreezeFrame))
            .complete(true)
            .callback(move |query| frames.take(query, &inquiries))
            .await
    }

    fn take(&self, query: Query, inquiries: &InquiryTally) {
        inquiries.received();
        match FreezeFrameQuestion::from_parameters(query.parameters().as_str()) {
            Ok(question) => {
                if let Some(query) = self.ask(question, query) {
                    inquiries.turned_away();
                    refuse(&query, TOO_MANY_QUESTIONS.to_owned());
                }
            }
            Err(error) => {
                inquiries.malformed();
                refuse(&query, error.to_string());
            }
        }
    }
}

/// Replies with the frame that is asked for, or with every one that is kept, without its signals.
pub(super) fn answer(
    speaker: &Speaker,
    album: &Album,
    question: FreezeFrameQuestion,
    query: &Query,
    inquiries: &InquiryTally,
) {
    let found = match question.transition {
        Some(sequence) => album.frame(sequence).map(|frame| vec![frame]),
        None => Ok(album.heads().cloned().collect()),
    };
    match found {
        Ok(frames) if frames.is_empty() => {
            inquiries.refused();
            refuse(query, NONE.to_owned());
        }
        Ok(frames) => {
            inquiries.answered();
            frames.iter().for_each(|frame| reply(speaker, query, frame));
        }
        Err(reason) => {
            inquiries.refused();
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
