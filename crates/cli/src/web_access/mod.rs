//! Who gets to the page of `trusswatch web`, and by which way.
//!
//! | file | what |
//! |---|---|
//! | `flags` | what `trusswatch web` takes for it |
//! | `link` | `trusswatch web link`: lets a person in, once |

mod flags;
mod link;

pub(crate) use flags::AccessFlags;
pub(crate) use link::{LinkArguments, run as link};
