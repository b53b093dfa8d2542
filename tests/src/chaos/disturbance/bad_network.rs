//! Loss, delay, reordering, partitions.

use std::sync::Arc;

use super::{Deed, Disturbance};
use crate::chaos::stage::{Site, Stage};
use crate::lab::{Impairment, Lab, Node};

/// Impaired links between nodes.
pub struct BadNetwork {
    impairment: Impairment,
    links: Vec<(Node, Node)>,
    lab: Option<Arc<Lab>>,
}

impl BadNetwork {
    /// All links between the plant and the modules, and among the modules.
    #[must_use]
    pub fn everywhere(impairment: Impairment) -> Self {
        let deployed = |(from, to): &(Node, Node)| ![*from, *to].contains(&Node::Observer);
        Self { impairment, links: Node::pairs().filter(deployed).collect(), lab: None }
    }

    /// Traffic among the modules.
    #[must_use]
    pub fn between_modules(impairment: Impairment) -> Self {
        let links = vec![(Node::Module1, Node::Module2), (Node::Module2, Node::Module1)];
        Self { impairment, links, lab: None }
    }

    /// Traffic from one node to another.
    #[must_use]
    pub fn one_way(from: Node, to: Node, impairment: Impairment) -> Self {
        Self { impairment, links: vec![(from, to)], lab: None }
    }
}

impl Disturbance for BadNetwork {
    fn set_up<'a>(&'a mut self, site: &'a mut Site) -> Deed<'a> {
        self.lab = Some(Arc::clone(&site.lab));
        Box::pin(async {})
    }

    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        for (from, to) in &self.links {
            stage.lab.impair(*from, *to, self.impairment);
        }
        Box::pin(async {})
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        stage.lab.heal();
        Box::pin(async {})
    }

    fn effect(&self) -> Result<String, String> {
        let Some(lab) = &self.lab else { return Err("never set up".into()) };
        let tallies = self.links.iter().map(|(from, to)| lab.tally(*from, *to));
        let (frames, gone) = tallies.fold((0, 0), |(frames, gone), tally| {
            let lost = tally.lost + tally.cut;
            (frames + tally.forwarded + lost, gone + lost)
        });
        if gone == 0 && (self.impairment.cut || self.impairment.loss > 0.0) {
            return Err("no frame was lost".into());
        }
        Ok(format!("{gone} of {frames} frames lost"))
    }
}
