//! Parts of pages as they change: rendered once for all who look at the same page, sent only if they changed, and to
//! each browser only the latest.
//!
//! | file | what |
//! |---|---|
//! | `part` | a part of a page, with the number of its latest change |
//! | `subject` | which page it is about |
//! | `rendering` | keeps the parts of a page up to date while somebody looks at it |
//! | `events` | `/stream`: as server-sent events |
//! | `poll` | `/fragments`: the same for who polls |

mod events;
mod part;
mod poll;
mod rendering;
mod subject;

pub(crate) use events::stream;
pub(crate) use part::{Part, Streams, part};
pub(crate) use poll::fragments;
pub(crate) use subject::{Subject, Whose};
