//! The processes of a row of towers, as `trusswatch replicate` lays it out.

use std::fmt;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use daemon::config::Schedule;
use session::Network;
use tempfile::TempDir;
use truss::{Structure, copy_prefix};
use vocabulary::{ModuleName, StructureName};

use crate::binaries::{configs, program};
use crate::deployment::MODULES;
use crate::observer::{Observer, Statuses};
use crate::process::{Process, log_of};

/// How long a hundred processes may take to find each other on a busy machine: a handshake that it was too slow
/// for is tried again.
const SETTLED_WITHIN: Duration = Duration::from_secs(180);

/// Who connects to whom.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topology {
    /// Every diagnoser to the plant and to its peers.
    Peers,
    /// All to a router.
    Star,
}

impl fmt::Display for Topology {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Topology::Peers => "peers",
            Topology::Star => "router",
        })
    }
}

/// A row to be measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Towers, each with two diagnosers.
    pub copies: usize,
    /// Who connects to whom.
    pub topology: Topology,
    /// Peers are the modules of this many towers on either side, besides those of the own one.
    pub neighbours: usize,
    /// Pace of the plant as a factor on real time.
    pub speed: f64,
    /// Steps of a message of samples; with one, messages come as the shipped configuration has it.
    pub block_steps: u32,
}

impl Setting {
    /// How many diagnosers there are.
    #[must_use]
    pub fn diagnosers(&self) -> usize {
        MODULES.len() * self.copies
    }

    /// Name of a module of a tower, counted from 0.
    #[must_use]
    pub fn module(&self, copy: usize, module: usize) -> String {
        format!("{}{}", copy_prefix(copy, self.copies), MODULES[module])
    }

    /// Names of all modules.
    #[must_use]
    pub fn modules(&self) -> Vec<String> {
        (0..self.copies).flat_map(|copy| [0, 1].map(|module| self.module(copy, module))).collect()
    }
}

/// Configurations in a folder of their own, and the processes that run by them.
pub struct Row {
    folder: TempDir,
    setting: Setting,
    structure: StructureName,
    /// Endpoints of all processes, or of the router only.
    endpoints: Vec<String>,
}

impl Row {
    /// Has the configurations made, with free ports.
    ///
    /// # Panics
    /// If they cannot be made.
    #[must_use]
    pub fn lay_out(setting: Setting, schedule: &Schedule) -> Self {
        let folder = crate::folder::temporary();
        let listeners = match setting.topology {
            Topology::Peers => setting.diagnosers() + 1,
            Topology::Star => 1,
        };
        let ports = session::loopback::reserve(u16::try_from(listeners).unwrap()).unwrap();
        let first_port = ports.start;
        let endpoints: Vec<String> = ports.map(|port| format!("tcp/127.0.0.1:{port}")).collect();
        let mut command = program("trusswatch");
        command.arg("replicate").args(MODULES.map(|name| configs().join(format!("{name}.toml"))));
        command.arg("--plant").arg(configs().join("plant.toml"));
        command.args(["--copies", &setting.copies.to_string()]);
        command.args(["--neighbours", &setting.neighbours.to_string()]);
        command.arg("--out").arg(folder.path().join("row"));
        match setting.topology {
            Topology::Peers => command.args(["--first-port", &first_port.to_string()]),
            Topology::Star => command.args(["--router", &endpoints[0]]),
        };
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let row = Self { structure: "none".parse().unwrap(), folder, setting, endpoints };
        if setting.block_steps > 1 {
            let plant = std::fs::read_to_string(row.file("plant.toml")).unwrap();
            let mut plant: toml::Table = toml::from_str(&plant).unwrap();
            plant.insert("burst_steps".into(), i64::from(setting.block_steps).into());
            plant.insert("blocks".into(), true.into());
            std::fs::write(row.file("plant.toml"), plant.to_string()).unwrap();
        }
        let schedule = toml::to_string(schedule).unwrap();
        std::fs::write(row.file("schedule.toml"), schedule).unwrap();
        let structure = std::fs::read_to_string(row.file("structure.toml")).unwrap();
        Self { structure: Structure::from_toml(&structure).unwrap().name, ..row }
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join("row").join(name)
    }

    fn launch(&self, command: Command, name: &str) -> Process {
        Process::start(command, self.folder.path(), name)
    }

    /// Starts the router, if there is to be one.
    #[must_use]
    pub fn start_router(&self) -> Option<Process> {
        let mut command = program("trusswatch");
        command.args(["router", "--zenoh"]).arg(self.file("router.json5"));
        (self.setting.topology == Topology::Star).then(|| self.launch(command, "router"))
    }

    /// Starts every diagnoser in the same instant, as when the power comes back.
    #[must_use]
    pub fn start_diagnosers(&self) -> Vec<Process> {
        let start = |module: String| {
            let mut command = program("trusswatch-diagnoser");
            command.arg("run").arg(self.file(&format!("{module}.toml")));
            self.launch(command, &module)
        };
        self.setting.modules().into_iter().map(start).collect()
    }

    /// Starts the plant, which waits for the diagnosers.
    #[must_use]
    pub fn start_plant(&self) -> Process {
        let mut command = program("trusswatch-plant");
        command.arg("run").arg(self.file("plant.toml")).args(["--run-id", "1"]);
        command.args(["--speed", &self.setting.speed.to_string()]);
        command.arg("--schedule").arg(self.file("schedule.toml"));
        self.launch(command, "plant")
    }

    /// A third party.
    ///
    /// # Panics
    /// If it gets no session.
    pub async fn observer(&self) -> Observer {
        let network = match self.setting.topology {
            Topology::Peers => Network::peer_of(&self.endpoints),
            Topology::Star => {
                Network { mode: Some(session::Mode::Client), ..Network::peer_of(&self.endpoints) }
            }
        };
        Observer::through(&network, self.structure.clone()).await
    }

    /// Waits until every diagnoser is there.
    ///
    /// # Panics
    /// With the logs of the missing ones.
    pub async fn wait_for_diagnosers(&self, observer: &Observer) {
        let modules: Vec<ModuleName> =
            self.setting.modules().iter().map(|name| name.parse().unwrap()).collect();
        let structure = &self.structure;
        let session = &observer.session;
        let there = session::client::wait_for(session, structure, &modules, false, SETTLED_WITHIN);
        if let Err(error) = there.await {
            let silent =
                modules.iter().filter(|module| error.to_string().contains(module.as_str()));
            let logs: Vec<String> = silent.map(|module| self.log(module.as_str())).collect();
            panic!("{error}\n{}", logs.join("\n"));
        }
    }

    /// Waits until every diagnoser reports each of its peers as present.
    ///
    /// # Panics
    /// With those that stay apart.
    pub async fn wait_for_each_other(&self, observer: &Observer) {
        let statuses = observer.statuses().await;
        let apart = |statuses: &Statuses| {
            let absent = statuses.values().flat_map(|status| {
                let absent = status.peers.iter().filter(|peer| !peer.present);
                absent.map(|peer| format!("{} misses {}", status.module, peer.module))
            });
            (self.setting.diagnosers() - statuses.len(), absent.collect::<Vec<_>>())
        };
        let together =
            statuses.first(|statuses| (apart(statuses) == (0, Vec::new())).then_some(()));
        if tokio::time::timeout(SETTLED_WITHIN, together).await.is_err() {
            let (unheard, apart) = apart(&statuses.so_far());
            panic!("{unheard} diagnosers unheard, {} pairs apart: {apart:?}", apart.len());
        }
    }

    /// What a process has logged, by name.
    #[must_use]
    pub fn log(&self, name: &str) -> String {
        log_of(self.folder.path(), name)
    }
}
