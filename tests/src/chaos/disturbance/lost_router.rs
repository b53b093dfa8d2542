//! Two linked routers, of which the one that the plant and the first module are clients of is killed and comes back.

use std::path::Path;
use std::sync::Arc;

use super::{Deed, Disturbance};
use crate::binaries::program;
use crate::chaos::stage::{Site, Stage};
use crate::deployment::Deployment;
use crate::lab::{Lab, Node};
use crate::process::Process;

/// Ports of the routers, and where the observer listens.
const ROUTER: u16 = 7500;
const OBSERVER: u16 = 7501;

/// The routers.
#[derive(Default)]
pub struct LostRouter {
    lab: Option<Arc<Lab>>,
    /// Beside the plant, and beside the second module; the second one connects to the first and to the observer.
    routers: Option<[Process; 2]>,
    killed: bool,
}

impl LostRouter {
    /// Everybody is a client of one of the routers.
    fn lay_out(&mut self, site: &mut Site) {
        let Site { lab, deployment } = site;
        self.lab = Some(Arc::clone(lab));
        for (place, router) in [(0, Node::Plant), (1, Node::Plant), (2, Node::Module2)] {
            deployment.make_client(place, &endpoint(lab, router, ROUTER));
        }
        deployment.onlooker = Some(endpoint(lab, Node::Observer, OBSERVER));
        self.routers = Some([Node::Plant, Node::Module2].map(|node| start(lab, deployment, node)));
    }
}

fn endpoint(lab: &Lab, node: Node, port: u16) -> String {
    format!("tcp/{}:{port}", lab.address(node))
}

fn start(lab: &Lab, deployment: &Deployment, node: Node) -> Process {
    let settings = Path::new(env!("CARGO_MANIFEST_DIR")).join("../configs/zenoh/router.json5");
    let mut command = program("trusswatch");
    command.args(["router", "--listen", &endpoint(lab, node, ROUTER), "--zenoh"]).arg(settings);
    if node == Node::Module2 {
        command.args(["--connect", &endpoint(lab, Node::Plant, ROUTER)]);
        command.args(["--connect", &endpoint(lab, Node::Observer, OBSERVER)]);
    }
    let name = format!("router beside {}", node.name());
    deployment.start_other(lab.command(node, command), &name)
}

impl Disturbance for LostRouter {
    fn set_up<'a>(&'a mut self, site: &'a mut Site) -> Deed<'a> {
        Box::pin(async { self.lay_out(site) })
    }

    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            let (lab, routers) = (self.lab.as_ref().unwrap(), self.routers.as_mut().unwrap());
            routers[0].crash().await;
            stage.observer.wait_until_gone(Node::Module1.name()).await;
            self.killed = true;
            routers[0] = start(lab, stage.deployment(), Node::Plant);
            stage.observer.wait_for(&[Node::Module1.name()], true).await;
        })
    }

    fn end<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {})
    }

    fn effect(&self) -> Result<String, String> {
        if self.killed { Ok(String::new()) } else { Err("no router was lost".to_owned()) }
    }
}
