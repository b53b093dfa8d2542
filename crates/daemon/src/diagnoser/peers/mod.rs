//! The peers: whether they are there, what they answer, when they are queried again.

mod backoff;
mod pause;
mod presence;
mod query;
mod standing;

pub(crate) use backoff::Backoff;
pub(crate) use pause::QueryPause;
pub(crate) use presence::{LOOK_EVERY, Presence, watch};
pub(crate) use query::PeerQueries;
pub(crate) use standing::PeerBook;
