//! The peers: whether they are there, what they answer, how long that is waited for, when they are queried again.

mod pause;
mod presence;
mod query;
mod retries;
mod standing;
mod timeouts;

pub(crate) use pause::QueryPause;
pub(crate) use presence::{LOOK_EVERY, Presence, watch};
pub(crate) use query::PeerQueries;
pub(crate) use retries::PeerRetries;
pub(crate) use standing::PeerBook;
