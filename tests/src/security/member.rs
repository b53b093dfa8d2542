//! A structure of a fleet: its processes, its own authority, and the router that is its gateway.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use daemon::config::Schedule;
use vocabulary::RunId;

use super::stand::{PARTS, pki, router, secure, switch_off};
use crate::binaries::configs;
use crate::deployment::{Deployment, MODULES, free_endpoint};
use crate::lab::{Lab, Node};
use crate::process::Process;

/// What the tower is called by itself.
const SHIPPED: &str = "tower";
/// Its gateway, in the structure.
const GATE: &str = "router.gate";
/// More steps than any test takes.
const FOR_LONG: u64 = 1_000_000;

/// The fleet as a member sees it.
pub(super) struct Above<'a> {
    /// The endpoint of its router.
    pub(super) door: &'a str,
    /// Where the gateway's certificate of the fleet is.
    pub(super) tls: PathBuf,
    pub(super) lease_ms: u32,
}

/// A copy of the tower under a name of its own, without its plant as yet.
pub struct Member {
    /// Certificates of the structure's own authority.
    pub library: PathBuf,
    /// Where clients in the structure connect.
    pub door: String,
    deployment: Deployment,
    rules: PathBuf,
    gate: Process,
    processes: Vec<Process>,
}

impl Member {
    /// Makes certificates, rules and configurations below a folder; starts the gateway and the diagnosers. In a laboratory
    /// the gateway is where the first module is.
    pub(super) async fn start(
        folder: &Path,
        name: &str,
        (schedule, lab): (&Schedule, Option<&Arc<Lab>>),
        above: &Above<'_>,
    ) -> Self {
        let host = lab.map_or("127.0.0.1".to_owned(), |lab| lab.address(Node::Module1).to_string());
        let door = secure(&free_endpoint()).replace("127.0.0.1", &host);
        let library = folder.join(name);
        pki(&library, &["authority", name]).await;
        let holders = PARTS.iter().chain(&[GATE, "operator.ada", "observer.wall"]);
        for holder in holders {
            pki(&library, &["issue", holder, "--address", &host]).await;
        }
        let rules = rules(folder, name, &library, above).await;
        let deployment = deployment(name, (schedule, lab), &door, &library);
        let command = router(&door, &rules, &library.join(GATE));
        let command = match lab {
            Some(lab) => lab.command(Node::Module1, command),
            None => command,
        };
        let gate = deployment.start_other(command, "gateway");
        let processes = deployment.start_diagnosers();
        Self { library, door, deployment, rules, gate, processes }
    }

    pub(super) fn start_plant(&mut self, seed: u64) {
        self.processes.push(self.deployment.start_plant("real", FOR_LONG, seed, RunId(1)));
    }

    /// Kills the diagnoser of the second module.
    pub async fn lose_a_module(&mut self) {
        self.processes.remove(MODULES.len() - 1).crash().await;
    }

    /// The gateway is started again without access control, on this machine.
    pub async fn lose_the_gate(&mut self) {
        switch_off(&self.rules);
        self.gate.crash().await;
        let command = router(&self.door, &self.rules, &self.library.join(GATE));
        self.gate = self.deployment.start_other(command, "gateway");
    }

    /// What the gateway has logged.
    #[must_use]
    pub fn gates_log(&self) -> String {
        self.gate.log()
    }

    pub(super) fn logs(&self) -> String {
        let mut logs = self.deployment.logs();
        let _ = write!(logs, "--- gateway\n{}", self.gates_log());
        logs
    }

    pub(super) async fn clear(self) {
        for process in self.processes {
            process.stop().await;
        }
        self.gate.stop().await;
    }
}

/// The gateway's rules, as the command prints them.
async fn rules(folder: &Path, name: &str, library: &Path, above: &Above<'_>) -> PathBuf {
    let tower = std::fs::read_to_string(configs().join("tower.toml")).unwrap();
    let mut structure: toml::Table = tower.parse().unwrap();
    structure.insert("name".into(), name.into());
    let description = folder.join(format!("{name}.toml"));
    std::fs::write(&description, structure.to_string()).unwrap();
    let (description, tls) = (description.display().to_string(), above.tls.display().to_string());
    let lease_ms = above.lease_ms.to_string();
    let words = [
        "access",
        &description,
        "--gateway",
        "hub.fleet=operator.ada",
        "--fleet-endpoint",
        above.door,
        "--fleet-tls",
        &tls,
        "--lease-ms",
        &lease_ms,
    ];
    let rules = folder.join(format!("{name}-gateway.json5"));
    std::fs::write(&rules, pki(library, &words).await).unwrap();
    rules
}

/// Clients of the gateway.
fn deployment(
    name: &str,
    (schedule, lab): (&Schedule, Option<&Arc<Lab>>),
    door: &str,
    library: &Path,
) -> Deployment {
    let deployment = match lab {
        Some(lab) => Deployment::in_lab(schedule, Arc::clone(lab)),
        None => Deployment::of_tower(schedule),
    };
    if name != SHIPPED {
        deployment.rename(name);
    }
    if lab.is_none() {
        deployment.patient();
    }
    for (place, holder) in PARTS.iter().enumerate() {
        deployment.set(place, "network", "mode", "client");
        deployment.set(place, "network", "listen", Vec::<String>::new());
        deployment.set(place, "network", "connect", vec![door.to_owned()]);
        deployment.set(place, "network", "tls", library.join(holder).display().to_string());
    }
    deployment
}
