//! A thread of a module panics: its process ends, and is started again.

use std::process::ExitStatus;
use std::sync::Arc;

use super::{Deed, Disturbance};
use crate::chaos::stage::{Site, Stage};
use crate::interposer::Interposer;
use crate::lab::Node;
use crate::process::is_end_by_panic;

/// What panics, and where.
pub struct Panic {
    node: Node,
    thread: &'static str,
    interposer: Option<Arc<Interposer>>,
    /// How the process ended.
    status: Option<ExitStatus>,
}

impl Panic {
    /// The thread of this name in a module's process.
    #[must_use]
    pub fn of(node: Node, thread: &'static str) -> Self {
        Self { node, thread, interposer: None, status: None }
    }
}

impl Disturbance for Panic {
    fn set_up<'a>(&'a mut self, site: &'a mut Site) -> Deed<'a> {
        Box::pin(async { self.interposer = Some(site.deployment.interpose(self.node.index() - 1)) })
    }

    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            let interposer = self.interposer.as_ref().unwrap();
            let order = format!("panic-{}", self.thread);
            interposer.order(&order);
            self.status = Some(stage.ended(self.node).await);
            interposer.call_off(&order);
        })
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(stage.revive(self.node))
    }

    fn effect(&self) -> Result<String, String> {
        match self.status {
            Some(status) if is_end_by_panic(status) => Ok(format!("the process ended ({status})")),
            other => Err(format!("the process ended with {other:?}")),
        }
    }
}
