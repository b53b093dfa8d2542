//! Freeze frames: what was seen around the latching of each of the latest faults, kept beside the journal and given to
//! whoever asks. One thread keeps and answers; nobody waits for it, so a disk that fails or hangs holds up no fault.
//!
//! | file | job |
//! |---|---|
//! | `album` | which frames are kept, how many at most, which goes first |
//! | `folder` | their files |
//! | `keeping` | the thread and its queue |
//! | `question` | `{module}/freeze-frame` |

mod album;
mod folder;
mod keeping;
mod question;

pub(crate) use keeping::FreezeFrames;
