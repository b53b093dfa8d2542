//! Messages handed over to the network, and questions replied to.

use vocabulary::{Key, Message, Refused};
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::query::Query;
use zenoh::sample::Sample;

/// Why a question is turned away that finds no room.
pub(crate) const TOO_MANY_QUESTIONS: &str = "query queue full; retry later";

/// Zenoh's name of a form of messages.
pub(crate) fn encoding(encoding: vocabulary::Encoding) -> Encoding {
    match encoding {
        vocabulary::Encoding::Json => Encoding::APPLICATION_JSON,
        vocabulary::Encoding::Cbor => Encoding::APPLICATION_CBOR,
    }
}

/// The form of a message with Zenoh's name of it: many who publish JSON give none.
pub(crate) fn encoding_of(named: &Encoding) -> vocabulary::Encoding {
    let usual = [Encoding::APPLICATION_JSON, Encoding::default()];
    let is_cbor = !usual.contains(named) && named.to_string().starts_with("application/cbor");
    if is_cbor { vocabulary::Encoding::Cbor } else { vocabulary::Encoding::Json }
}

/// A message whose own key is the one that it came on: a module speaks for itself only. Otherwise the reason why it cannot
/// be used.
pub(crate) fn read<M: Message>(sample: &Sample, key: fn(&M) -> Key) -> Result<M, String> {
    let message = vocabulary::decode::<M>(&sample.payload().to_bytes());
    let message = message.map_err(|error| error.to_string())?;
    let own = key(&message);
    let is_its = own.to_string() == sample.key_expr().as_str();
    is_its.then_some(message).ok_or_else(|| format!("it is of `{own}`"))
}

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
