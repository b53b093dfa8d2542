//! One question to one process, which ends in one of three ways: answered, refused, unanswered.

use std::fmt::Display;
use std::time::Duration;

use vocabulary::{Key, Message, Refused};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::handlers::{DefaultHandler, FifoChannelHandler};
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
use zenoh::session::SessionGetBuilder;

use observer::QueryError;

/// The replies to a query.
pub(super) type Replies = FifoChannelHandler<Reply>;

/// Queries one process. Returns the first answer, because one process owns a key.
pub(super) async fn ask<A: Message>(
    session: &Session,
    key: &Key,
    parameters: &str,
    timeout: Duration,
) -> Result<A, QueryError> {
    let selector =
        if parameters.is_empty() { key.to_string() } else { format!("{key}?{parameters}") };
    answer(session.get(selector), timeout).await.map_err(|error| untaken(error, timeout))
}

/// Like [`ask`], with a message as payload. Returns [`QueryError::Untaken`] if no process accepted the command, in
/// contrast to an answer that is late.
pub(super) async fn command<A: Message>(
    session: &Session,
    key: &Key,
    message: &impl Message,
    timeout: Duration,
) -> Result<A, QueryError> {
    let payload = vocabulary::encode(message).map_err(senseless)?;
    let query = session.get(key.to_string()).payload(payload);
    answer(query.encoding(Encoding::APPLICATION_JSON), timeout).await
}

/// Maps a question that no process accepted to a timeout.
pub(super) fn untaken(error: QueryError, timeout: Duration) -> QueryError {
    match error {
        QueryError::Untaken => QueryError::Unanswered(timeout),
        other => other,
    }
}

async fn answer<A: Message>(
    query: SessionGetBuilder<'_, '_, DefaultHandler>,
    timeout: Duration,
) -> Result<A, QueryError> {
    let query = query.consolidation(ConsolidationMode::None).timeout(timeout);
    let replies = query.await.map_err(senseless)?;
    match tokio::time::timeout(timeout, replies.recv_async()).await {
        Ok(Ok(reply)) => read(&reply, timeout),
        Ok(Err(_)) => Err(QueryError::Untaken),
        Err(_) => Err(QueryError::Unanswered(timeout)),
    }
}

/// Queries every process that answers on these keys; the replies end after `timeout`.
pub(super) async fn ask_all(
    session: &Session,
    expression: String,
    timeout: Duration,
) -> zenoh::Result<Replies> {
    session
        .get(expression)
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(timeout)
        .await
}

/// Decodes a reply. An error reply that is not a [`Refused`] comes from Zenoh itself.
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
