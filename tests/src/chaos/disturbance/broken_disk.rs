//! The disk of a module hangs or is full.

use std::sync::Arc;

use super::{Deed, Disturbance};
use crate::chaos::stage::{Site, Stage};
use crate::interposer::Interposer;
use crate::lab::Node;

/// What happens to the disk of a module, and whether its process is killed at the end of it and starts on what is there.
pub struct BrokenDisk {
    node: Node,
    what: &'static str,
    kill: bool,
    interposer: Option<Arc<Interposer>>,
    /// What the module said of its journal at the end.
    problem: Option<String>,
}

impl BrokenDisk {
    /// `what`: an order to the [`Interposer`].
    #[must_use]
    pub fn new(node: Node, what: &'static str) -> Self {
        Self { node, what, kill: false, interposer: None, problem: None }
    }

    /// The same; the process is killed before the disk is well again.
    #[must_use]
    pub fn and_kill(node: Node, what: &'static str) -> Self {
        Self { kill: true, ..Self::new(node, what) }
    }
}

impl Disturbance for BrokenDisk {
    fn set_up<'a>(&'a mut self, site: &'a mut Site) -> Deed<'a> {
        Box::pin(async { self.interposer = Some(site.deployment.interpose(self.node.index() - 1)) })
    }

    fn begin<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async { self.interposer.as_ref().unwrap().order(self.what) })
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            let has_problem = |status: &vocabulary::ModuleStatus| status.journal.problem.is_some();
            let status = stage.observer.status_of(self.node.name(), has_problem).await;
            self.problem = status.journal.problem;
            if self.kill {
                stage.crash(self.node).await;
            }
            self.interposer.as_ref().unwrap().call_off(self.what);
            if self.kill {
                stage.revive(self.node).await;
            }
        })
    }

    fn effect(&self) -> Result<String, String> {
        self.problem.clone().ok_or_else(|| "the module never noticed".to_owned())
    }
}
