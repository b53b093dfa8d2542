//! Parts of pages as they change: rendered once for all who look at the same page, sent only if they changed, and to
//! each browser only the latest.
//!
//! | file | what |
//! |---|---|
//! | `rendering` | keeps the parts of a page up to date while somebody looks at it |
//! | `events` | `/stream`: as server-sent events |
//! | `poll` | `/fragments`: the same for who polls |

mod events;
mod poll;
mod rendering;

pub(crate) use events::stream;
pub(crate) use poll::fragments;
