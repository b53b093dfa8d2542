//! Changed parts of pages: rendered once for all viewers of a page, sent only if changed, and to each browser only the
//! latest.
//!
//! | file | what |
//! |---|---|
//! | `rendering` | renders the parts of a page while it is viewed |
//! | `events` | `/stream`: as server-sent events |
//! | `poll` | `/fragments`: the same for clients that poll |

mod events;
mod poll;
mod rendering;

pub(crate) use events::stream;
pub(crate) use poll::fragments;
