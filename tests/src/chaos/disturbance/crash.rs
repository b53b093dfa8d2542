//! Processes are killed with SIGKILL and restarted.

use super::{Deed, Disturbance};
use crate::chaos::stage::Stage;
use crate::lab::Node;

/// Kills all of these at once and starts them again in this order, each when the one before is there.
/// A plant that starts again begins a new run.
pub struct Crash(pub Vec<Node>);

impl Disturbance for Crash {
    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            for node in &self.0 {
                stage.crash(*node).await;
            }
        })
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            for node in &self.0 {
                stage.revive(*node).await;
            }
        })
    }
}
