//! A thread of a module panics: its process ends, and is started again.

use std::sync::Arc;

use super::{Deed, Disturbance};
use crate::chaos::stage::{Site, Stage};
use crate::interposer::Interposer;
use crate::lab::Node;

/// What panics, and where.
pub struct Panic {
    node: Node,
    thread: &'static str,
    interposer: Option<Arc<Interposer>>,
    /// The exit code of the process.
    code: Option<i32>,
}

impl Panic {
    /// The thread of this name in a module's process.
    #[must_use]
    pub fn of(node: Node, thread: &'static str) -> Self {
        Self { node, thread, interposer: None, code: None }
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
            self.code = stage.ended(self.node).await;
            interposer.call_off(&order);
        })
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(stage.revive(self.node))
    }

    fn effect(&self) -> Result<String, String> {
        match self.code {
            Some(1) => Ok("the process ended by itself".to_owned()),
            other => Err(format!("the process ended with {other:?}")),
        }
    }
}
