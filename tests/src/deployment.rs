//! A plant and its diagnosers as processes of this machine, each with a port of its own on the
//! loopback or with an address of its own in a laboratory.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;

use daemon::config::{
    DiagnoserConfig, PlantConfig, PlantFlags, Schedule, load_diagnoser, load_plant,
};
use parking_lot::Mutex;
use tempfile::TempDir;
use vocabulary::RunId;

use crate::binaries::{configs, program};
use crate::interposer::Interposer;
use crate::lab::{Lab, Node};
use crate::process::{Process, log_of};

/// The modules of the tower.
pub const MODULES: [&str; 2] = ["module1", "module2"];

/// Port of every process in a laboratory.
const LAB_PORT: u16 = 7447;
/// From one status to the next \[ms\]. Programs wait for the next status of each module a little longer than the shipped
/// interval, which a busy machine exceeds.
const STATUS_EVERY_MS: i64 = 100;
/// The longest lease that a session may have \[ms\].
pub(crate) const LONGEST_LEASE_MS: u32 = 60_000;

/// An endpoint without a listener.
#[must_use]
pub fn free_endpoint() -> String {
    session::loopback::endpoints().map(|[endpoint]| endpoint).unwrap()
}

/// Configurations in a folder of their own.
pub struct Deployment {
    folder: TempDir,
    /// The plant's, then each module's.
    pub endpoints: Vec<String>,
    /// Where an onlooker listens, if one does.
    pub onlooker: Option<String>,
    lab: Option<Arc<Lab>>,
    interposers: Mutex<BTreeMap<usize, Arc<Interposer>>>,
}

impl Deployment {
    /// Copies of the shipped configurations of the tower, with free ports and this schedule.
    #[must_use]
    pub fn of_tower(schedule: &Schedule) -> Self {
        let endpoints = Node::DEPLOYED.map(|_| free_endpoint()).into();
        Self::new(schedule, endpoints, None, None)
    }

    /// The same, and every process connects to the observer by itself: a restarted process is
    /// seen at once, not at the observer's next retry.
    #[must_use]
    pub fn of_watched_tower(schedule: &Schedule) -> Self {
        let endpoints = Node::DEPLOYED.map(|_| free_endpoint()).into();
        Self::new(schedule, endpoints, Some(free_endpoint()), None)
    }

    /// The same in a laboratory, where every process has a network card of its own.
    #[must_use]
    pub fn in_lab(schedule: &Schedule, lab: Arc<Lab>) -> Self {
        let endpoint = |node| format!("tcp/{}:{LAB_PORT}", lab.address(node));
        let endpoints = Node::DEPLOYED.map(endpoint).into();
        Self::new(schedule, endpoints, None, Some(lab))
    }

    fn new(
        schedule: &Schedule,
        endpoints: Vec<String>,
        onlooker: Option<String>,
        lab: Option<Arc<Lab>>,
    ) -> Self {
        let deployment = Self {
            folder: crate::folder::temporary(),
            endpoints,
            onlooker,
            lab,
            interposers: Mutex::default(),
        };
        for place in 0..deployment.endpoints.len() {
            deployment.copy_config(place);
        }
        std::fs::write(deployment.schedule(), toml::to_string(schedule).unwrap()).unwrap();
        deployment
    }

    /// Writes a shipped file with its paths made absolute and the network of this deployment.
    fn copy_config(&self, place: usize) {
        let name = self.file_name(place);
        let configs = configs();
        let text = std::fs::read_to_string(configs.join(&name)).unwrap();
        let mut table: toml::Table = text.parse().unwrap();
        for key in ["structure", "thresholds", "reference"] {
            if let Some(path) = table.get(key).and_then(toml::Value::as_str) {
                let path = configs.join(path).canonicalize().unwrap();
                table.insert(key.into(), path.to_str().unwrap().into());
            }
        }
        let own = &self.endpoints[place];
        // As in the shipped files: of two, the later one connects.
        let mut connect = self.endpoints[..place].to_vec();
        connect.extend(self.onlooker.clone());
        let mut network = toml::Table::new();
        network.insert("listen".into(), vec![own.clone()].into());
        network.insert("connect".into(), connect.into());
        table.insert("network".into(), network.into());
        if let Some(publish) = table.get_mut("publish").and_then(toml::Value::as_table_mut) {
            publish.insert("status_every_ms".into(), STATUS_EVERY_MS.into());
        }
        self.keep_state_here(place, &mut table);
        std::fs::write(self.folder.path().join(name), table.to_string()).unwrap();
    }

    /// A process that keeps a state keeps it in this deployment's folder, so that it is there after a
    /// restart and in no other test.
    fn keep_state_here(&self, place: usize, table: &mut toml::Table) {
        if let Some(state) = table.get_mut("state").and_then(toml::Value::as_table_mut) {
            let directory = self.state_directory_at(place);
            std::fs::create_dir_all(&directory).unwrap();
            state.insert("directory".into(), directory.to_str().unwrap().into());
        }
    }

    fn state_directory_at(&self, place: usize) -> PathBuf {
        self.folder.path().join(format!("state-{place}"))
    }

    /// Where the diagnoser of the module at `index` keeps its state.
    #[must_use]
    pub fn state_directory(&self, index: usize) -> PathBuf {
        self.state_directory_at(index + 1)
    }

    /// Changes the configuration of the module at `index`.
    pub fn reconfigure(&self, index: usize, change: impl FnOnce(&mut toml::Table)) {
        self.change(index + 1, change);
    }

    /// Changes the configuration of the plant.
    pub fn reconfigure_plant(&self, change: impl FnOnce(&mut toml::Table)) {
        self.change(0, change);
    }

    /// Changes a setting of the plant, whose place is 0, or of a module, before it is started.
    pub fn set(&self, place: usize, table: &str, key: &str, value: impl Into<toml::Value>) {
        self.change(place, |document| {
            document[table].as_table_mut().unwrap().insert(key.into(), value.into());
        });
    }

    /// Gives all processes the longest limits that may be configured, before they are started: for tests of which these
    /// are not the subject. On a busy machine an answer takes longer than the shipped ones allow.
    pub fn patient(&self) {
        for place in 0..self.endpoints.len() {
            self.set(place, "network", "lease_ms", i64::from(LONGEST_LEASE_MS));
        }
        self.patient_but_for_leases();
    }

    /// The same without leases, which a file of Zenoh's settings has instead.
    pub fn patient_but_for_leases(&self) {
        for place in 1..self.endpoints.len() {
            for (key, ms) in [("timeout_ms", 10_000), ("pause_ms", 10_000), ("hold_ms", 60_000)] {
                self.set(place, "queries", key, ms);
            }
        }
        self.patient_with_samples();
        self.set(0, "lock_step", "timeout_ms", 3_600_000);
    }

    /// The same for samples only: none is dropped because a diagnoser is behind.
    pub fn patient_with_samples(&self) {
        for place in 1..self.endpoints.len() {
            for (key, ms) in [
                ("stale_after_ms", 3_600_000),
                ("resync_after_ms", 60_000),
                ("incumbent_ms", 60_000),
            ] {
                self.set(place, "input", key, ms);
            }
        }
    }

    /// Has statuses published as often as the shipped configurations have it, before anything is started.
    pub fn publish_as_shipped(&self) {
        for place in 1..self.endpoints.len() {
            self.set(place, "publish", "status_every_ms", 1000);
        }
    }

    /// Makes a process a client of a router, before it is started.
    pub fn make_client(&self, place: usize, router: &str) {
        self.change(place, |document| {
            let network = [("mode", "client".into()), ("connect", vec![router.to_owned()].into())];
            let network = network.map(|(key, value): (_, toml::Value)| (key.to_owned(), value));
            document.insert("network".into(), toml::Table::from_iter(network).into());
        });
    }

    /// Gives the structure another name, before anything is started. Its modules have no references then: those that
    /// are shipped are of the structure under its own name.
    pub fn rename(&self, structure: &str) {
        for place in 0..self.endpoints.len() {
            let file = self.folder.path().join(format!("structure-{place}.toml"));
            self.change(place, |document| {
                let text = std::fs::read_to_string(document["structure"].as_str().unwrap());
                let mut renamed: toml::Table = text.unwrap().parse().unwrap();
                renamed.insert("name".into(), structure.into());
                std::fs::write(&file, renamed.to_string()).unwrap();
                document.insert("structure".into(), file.to_str().unwrap().into());
                document.remove("reference");
            });
        }
    }

    fn change(&self, place: usize, change: impl FnOnce(&mut toml::Table)) {
        let file = self.file(place);
        let mut table: toml::Table = std::fs::read_to_string(&file).unwrap().parse().unwrap();
        change(&mut table);
        std::fs::write(file, table.to_string()).unwrap();
    }

    fn file_name(&self, place: usize) -> String {
        match place {
            0 => "plant.toml".into(),
            place => format!("{}.toml", MODULES[place - 1]),
        }
    }

    fn file(&self, place: usize) -> PathBuf {
        self.folder.path().join(self.file_name(place))
    }

    fn schedule(&self) -> PathBuf {
        self.folder.path().join("schedule.toml")
    }

    /// From now on the diagnoser of the module at `index` is started behind this.
    #[must_use]
    pub fn interpose(&self, index: usize) -> Arc<Interposer> {
        let interposer = Arc::new(Interposer::of(self.state_directory(index)));
        self.interposers.lock().insert(index, Arc::clone(&interposer));
        interposer
    }

    /// Has every process a network card of its own?
    pub(crate) fn is_in_lab(&self) -> bool {
        self.lab.is_some()
    }

    /// Bytes that the process at this place keeps on the disk.
    #[must_use]
    pub fn state_bytes(&self, place: usize) -> u64 {
        let files = std::fs::read_dir(self.state_directory_at(place)).unwrap();
        files.map(|file| file.unwrap().metadata().map_or(0, |metadata| metadata.len())).sum()
    }

    /// What all processes have logged.
    #[must_use]
    pub fn logs(&self) -> String {
        let log = |name| format!("--- {name}\n{}", log_of(self.folder.path(), name));
        ["plant"].into_iter().chain(MODULES).map(log).collect()
    }

    /// The plant's configuration as the process reads it.
    #[must_use]
    pub fn plant_config(&self, seed: u64) -> PlantConfig {
        let flags = PlantFlags {
            seed: Some(seed),
            schedule: Some(self.schedule()),
            ..PlantFlags::default()
        };
        load_plant(&self.file(0), &flags).unwrap()
    }

    /// The diagnosers' configurations as the processes read them.
    #[must_use]
    pub fn diagnoser_configs(&self) -> Vec<DiagnoserConfig> {
        (1..self.endpoints.len()).map(|place| load_diagnoser(&self.file(place)).unwrap()).collect()
    }

    /// Starts the plant.
    #[must_use]
    pub fn start_plant(&self, speed: &str, steps: u64, seed: u64, run: RunId) -> Process {
        let mut command = program("trusswatch-plant");
        command.arg("run").arg(self.file(0)).args(["--speed", speed, "--schedule"]);
        command.arg(self.schedule()).args(["--run-id", &run.to_string()]);
        command.args(["--steps", &steps.to_string(), "--seed", &seed.to_string()]);
        self.launch(Node::Plant, command, "plant")
    }

    /// Starts the diagnoser of the module at `index`.
    #[must_use]
    pub fn start_diagnoser(&self, index: usize) -> Process {
        let mut command = program("trusswatch-diagnoser");
        command.arg("run").arg(self.file(index + 1));
        if let Some(interposer) = self.interposers.lock().get(&index) {
            interposer.preload(&mut command);
        }
        self.launch(Node::DEPLOYED[index + 1], command, MODULES[index])
    }

    fn launch(&self, node: Node, command: Command, name: &str) -> Process {
        let command = match &self.lab {
            Some(lab) => lab.command(node, command),
            None => command,
        };
        self.start_other(command, name)
    }

    /// Starts a program of another kind, with a log of its own.
    #[must_use]
    pub fn start_other(&self, command: Command, name: &str) -> Process {
        Process::start(command, self.folder.path(), name)
    }

    /// Starts every diagnoser.
    #[must_use]
    pub fn start_diagnosers(&self) -> Vec<Process> {
        (0..MODULES.len()).map(|index| self.start_diagnoser(index)).collect()
    }
}
