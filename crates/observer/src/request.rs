//! One question to one process, and the three ways it can end: answered, refused, unanswered.

use std::fmt::Display;
use std::time::Duration;

use vocabulary::{Key, Message, Refused};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::query::{ConsolidationMode, Reply};

use super::view::QueryError;

/// A question without a place to go to yet.
#[derive(Debug, Default)]
pub(super) struct Question {
    /// The parameters of the query.
    pub(super) parameters: String,
    /// The payload of the query.
    pub(super) payload: Option<Vec<u8>>,
}

impl Question {
    /// One that is all in its parameters.
    pub(super) fn of_parameters(parameters: String) -> Self {
        Self { parameters, payload: None }
    }

    /// One that is all in its payload.
    pub(super) fn of_message<M: Message>(message: &M) -> Result<Self, QueryError> {
        let payload = vocabulary::encode(message).map_err(senseless)?;
        Ok(Self { parameters: String::new(), payload: Some(payload) })
    }
}

/// Queries one process. The first answer is accepted: one process owns a key.
pub(super) async fn ask<A: Message>(
    session: &Session,
    key: &Key,
    question: Question,
    timeout: Duration,
) -> Result<A, QueryError> {
    let answer = command_to(session, key, question, timeout).await;
    answer.map_err(|error| match error {
        QueryError::Untaken => QueryError::Unanswered(timeout),
        other => other,
    })
}

/// The same, and tells [`QueryError::Untaken`] from an answer that does not come in time.
pub(super) async fn command_to<A: Message>(
    session: &Session,
    key: &Key,
    question: Question,
    timeout: Duration,
) -> Result<A, QueryError> {
    let key = key.to_string();
    let selector =
        if question.parameters.is_empty() { key } else { format!("{key}?{}", question.parameters) };
    let mut query = session.get(selector).consolidation(ConsolidationMode::None).timeout(timeout);
    if let Some(payload) = question.payload {
        query = query.payload(payload).encoding(Encoding::APPLICATION_JSON);
    }
    let replies = query.await.map_err(senseless)?;
    let reply = tokio::time::timeout(timeout, replies.recv_async()).await;
    match reply {
        Ok(Ok(reply)) => read(&reply, timeout),
        Ok(Err(_)) => Err(QueryError::Untaken),
        Err(_) => Err(QueryError::Unanswered(timeout)),
    }
}

/// Decodes a reply. A reply that is an error but no refusal comes from the network itself.
pub(super) fn read<A: Message>(reply: &Reply, timeout: Duration) -> Result<A, QueryError> {
    match reply.result() {
        Ok(sample) => vocabulary::decode(&sample.payload().to_bytes()).map_err(senseless),
        Err(error) => match vocabulary::decode::<Refused>(&error.payload().to_bytes()) {
            Ok(Refused { reason }) => Err(QueryError::Refused(reason)),
            Err(_) => Err(QueryError::Unanswered(timeout)),
        },
    }
}

pub(super) fn senseless(error: impl Display) -> QueryError {
    QueryError::Senseless(error.to_string())
}
