//! What is shown beside the scene, had once for all pages: a hundred open pages cost a module no more than one.
//!
//! | file | what |
//! |---|---|
//! | `answers` | answers of modules, kept for a moment |
//! | `journals` | what a module's journal holds |
//! | `frames` | the freeze frame of a component's fault |
//! | `traces` | a module's divergences of the last minute |

mod answers;
mod frames;
mod journals;
mod traces;

use std::sync::Arc;
use std::time::Duration;

use names::{ModuleName, StructureName};
use tokio::sync::Semaphore;

use crate::hub::Hub;
use crate::part::Parts;
use crate::subject::Subject;

pub(crate) use frames::{Frame, Frames};
pub(crate) use journals::{Journal, Journals};
pub(crate) use traces::{Traces, watch};

/// Streams at a time; further pages poll.
pub(crate) const STREAMS: usize = 256;
/// How long work goes on after the last has looked away: a reload does not begin it anew.
const LINGER: Duration = Duration::from_secs(10);

/// What is shown beside the scene.
#[derive(Debug)]
pub(crate) struct Desk {
    /// The parts of each page that somebody looks at.
    pub(crate) pages: Hub<Subject, Arc<Parts>>,
    /// The divergences of each module that somebody looks at.
    pub(crate) traces: Hub<(StructureName, ModuleName), Arc<Traces>>,
    pub(crate) journals: Journals,
    pub(crate) frames: Frames,
    /// Places for streams.
    pub(crate) streams: Arc<Semaphore>,
}

impl Default for Desk {
    fn default() -> Self {
        Self {
            pages: Hub::new(LINGER),
            traces: Hub::new(LINGER),
            journals: Journals::default(),
            frames: Frames::default(),
            streams: Arc::new(Semaphore::new(STREAMS)),
        }
    }
}
