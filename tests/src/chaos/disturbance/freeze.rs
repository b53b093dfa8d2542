//! A process is suspended: it keeps its connections and replies to nothing.

use nix::sys::signal::Signal;

use super::{Deed, Disturbance};
use crate::chaos::stage::Stage;
use crate::lab::Node;

/// Suspends a process (SIGSTOP) and resumes it.
pub struct Freeze(pub Node);

impl Disturbance for Freeze {
    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async { stage.signal(self.0, Signal::SIGSTOP) })
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async { stage.signal(self.0, Signal::SIGCONT) })
    }
}
