//! Structures behind gateways, and the router of their fleet, under the access control that `trusswatch pki` prints.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use daemon::config::Schedule;
use session::{Mode, Network};
use tempfile::TempDir;
use zenoh::Session;

use super::member::{Above, Member};
use super::stand::{gives_up, pki, router, secure, switch_off};
use super::trace::line_of;
use crate::binaries::program;
use crate::deployment::free_endpoint;
use crate::in_time;
use crate::lab::{Lab, Node};
use crate::operate::{Ended, ended, wait_patiently};
use crate::process::Process;

/// Everything that is running, and the fleet's certificates.
pub struct Fleet {
    /// Certificates of the fleet's authority.
    library: PathBuf,
    /// Where people of the fleet connect.
    door: String,
    rules: PathBuf,
    hub: Process,
    /// The structures, in the order of their names as given.
    pub members: Vec<Member>,
    folder: TempDir,
}

impl Fleet {
    /// Each structure with its faults, on this machine. Their plants are to be started.
    pub async fn of(structures: &[(&str, Schedule)]) -> Self {
        Self::start(structures, None, session::DEFAULT_LEASE_MS).await
    }

    /// One structure in a laboratory, the fleet's router at the observer.
    pub async fn afar(name: &str, schedule: Schedule, lab: &Arc<Lab>, lease_ms: u32) -> Self {
        Self::start(&[(name, schedule)], Some(lab), lease_ms).await
    }

    async fn start(structures: &[(&str, Schedule)], lab: Option<&Arc<Lab>>, lease_ms: u32) -> Self {
        let folder = crate::folder::temporary();
        let host = lab.map_or("127.0.0.1".into(), |lab| lab.address(Node::Observer).to_string());
        let door = secure(&free_endpoint()).replace("127.0.0.1", &host);
        let library = folder.path().join("fleet");
        let names: Vec<&str> = structures.iter().map(|(name, _)| *name).collect();
        let rules = folder.path().join("hub.json5");
        std::fs::write(&rules, papers(&library, &names, &host, lease_ms).await).unwrap();
        let hub = hub(&door, &rules, &library, folder.path());
        let mut members = Vec::new();
        for (name, schedule) in structures {
            let tls = library.join(format!("router.{name}"));
            let above = Above { door: &door, tls, lease_ms };
            members.push(Member::start(folder.path(), name, (schedule, lab), &above).await);
        }
        Self { library, door, rules, hub, members, folder }
    }

    /// From here on the structures are in motion.
    pub fn start_plants(&mut self) {
        for (member, seed) in self.members.iter_mut().zip(11..) {
            member.start_plant(seed);
        }
    }

    /// The fleet's router is started again without access control.
    pub async fn lose_the_hub(&mut self) {
        switch_off(&self.rules);
        self.hub.crash().await;
        self.hub = hub(&self.door, &self.rules, &self.library, self.folder.path());
    }

    /// A session at the fleet's router.
    pub async fn session(&self, holder: &str) -> Session {
        open(&self.door, self.library.join(holder)).await
    }

    /// A session at the gateway of a structure, of a holder there.
    pub async fn session_within(&self, member: usize, holder: &str) -> Session {
        let member = &self.members[member];
        open(&member.door, member.library.join(holder)).await
    }

    /// How `trusswatch` with these words ends at the fleet's router.
    pub async fn trusswatch(&self, holder: &str, words: &[&str]) -> Ended {
        let mut command = program("trusswatch");
        command.args(words).args(["--connect", &self.door, "--tls"]).arg(self.library.join(holder));
        wait_patiently(&mut command, words);
        ended(command).await
    }

    /// What the routers have logged.
    #[must_use]
    pub fn routers_log(&self) -> String {
        let gates = self.members.iter().map(Member::gates_log);
        std::iter::once(self.hub.log()).chain(gates).collect()
    }

    /// The line of a router's log with all of these words, as soon as there is one.
    pub async fn trace(&self, words: &[&str]) -> Option<String> {
        line_of(|| self.routers_log(), words).await
    }

    /// What all processes have logged.
    #[must_use]
    pub fn logs(&self) -> String {
        let members: String = self.members.iter().map(Member::logs).collect();
        format!("--- hub\n{}{members}", self.hub.log())
    }

    /// Ends everything in order.
    pub async fn clear(self) {
        for member in self.members {
            member.clear().await;
        }
        self.hub.stop().await;
    }
}

/// Makes the fleet's certificates; returns the rules of its router.
async fn papers(library: &Path, names: &[&str], host: &str, lease_ms: u32) -> String {
    pki(library, &["authority", "fleet"]).await;
    pki(library, &["issue", "router.hub", "--address", host]).await;
    for name in names {
        pki(library, &["issue", &format!("router.{name}")]).await;
    }
    pki(library, &["issue", "operator.ada", "observer.wall"]).await;
    let lease_ms = lease_ms.to_string();
    pki(library, &[&["fleet", "fleet"], names, &["--lease-ms", &lease_ms]].concat()).await
}

fn hub(door: &str, rules: &Path, library: &Path, folder: &Path) -> Process {
    Process::start(router(door, rules, &library.join("router.hub")), folder, "hub")
}

async fn open(door: &str, tls: PathBuf) -> Session {
    let network = Network {
        mode: Some(Mode::Client),
        connect: vec![door.to_owned()],
        tls: Some(tls),
        ..Network::default()
    };
    let settings = gives_up(session::settings(&network).unwrap());
    let opening = async { zenoh::open(settings).await };
    in_time(&format!("a session at {door}"), opening).await.unwrap()
}
