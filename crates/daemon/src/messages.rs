//! Messages handed over to the network, and questions replied to.

use vocabulary::{Message, Refused};
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::query::Query;

/// Why a question is turned away that finds no room.
pub(crate) const TOO_MANY_QUESTIONS: &str = "query queue full; retry later";

/// Replies to a question on the key that it was put to.
pub(crate) fn reply<M: Message>(query: &Query, message: &M) {
    put(message, |bytes| {
        query.reply(query.key_expr().clone(), bytes).encoding(Encoding::APPLICATION_JSON).wait()
    });
}

/// Replies that nothing was done and nothing is known.
pub(crate) fn refuse(query: &Query, reason: String) {
    put(&Refused { reason }, |bytes| {
        query.reply_err(bytes).encoding(Encoding::APPLICATION_JSON).wait()
    });
}

/// Encodes and sends a message. Errors, e.g. of a session that is closing, are only logged.
pub(crate) fn put<M: Message>(message: &M, send: impl FnOnce(Vec<u8>) -> zenoh::Result<()>) {
    match vocabulary::encode(message) {
        Ok(bytes) => {
            if let Err(error) = send(bytes) {
                tracing::debug!("{} not sent: {error}", M::WHAT);
            }
        }
        Err(error) => tracing::error!("{error}"),
    }
}
