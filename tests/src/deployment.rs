//! A plant and its diagnosers as processes of this machine, each with a port of its own.

use std::fs::File;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

use daemon::config::{
    DiagnoserConfig, PlantConfig, PlantFlags, Schedule, load_diagnoser, load_plant,
};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tempfile::TempDir;
use truss::ids::RunId;

use crate::binaries::{configs, program};

/// An endpoint on a port that was free a moment ago.
#[must_use]
pub fn free_endpoint() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    format!("tcp/{}", listener.local_addr().unwrap())
}

/// Configurations in a folder of their own.
pub struct Deployment {
    folder: TempDir,
    modules: Vec<String>,
    /// The plant's, then each module's.
    pub endpoints: Vec<String>,
}

impl Deployment {
    /// Copies of the shipped configurations of the tower, with free ports and this schedule.
    #[must_use]
    pub fn of_tower(schedule: &Schedule) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let modules = vec!["module1".to_string(), "module2".to_string()];
        let endpoints: Vec<String> = (0..=modules.len()).map(|_| free_endpoint()).collect();
        let deployment = Self { folder, modules, endpoints };
        for place in 0..deployment.endpoints.len() {
            deployment.copy_config(place);
        }
        std::fs::write(deployment.schedule(), toml::to_string(schedule).unwrap()).unwrap();
        deployment
    }

    /// Writes a shipped file with its paths made absolute and the network of this deployment.
    fn copy_config(&self, place: usize) {
        let name = self.file_name(place);
        let text = std::fs::read_to_string(configs().join(&name)).unwrap();
        let mut table: toml::Table = text.parse().unwrap();
        for key in ["structure", "thresholds"] {
            if let Some(path) = table.get(key).and_then(toml::Value::as_str) {
                let path = configs().join(path).canonicalize().unwrap();
                table.insert(key.into(), path.to_str().unwrap().into());
            }
        }
        let own = &self.endpoints[place];
        let others = || self.endpoints.iter().filter(|endpoint| *endpoint != own);
        let connect = if place == 0 { Vec::new() } else { others().cloned().collect() };
        let mut network = toml::Table::new();
        network.insert("listen".into(), vec![own.clone()].into());
        network.insert("connect".into(), connect.into());
        table.insert("network".into(), network.into());
        std::fs::write(self.folder.path().join(name), table.to_string()).unwrap();
    }

    fn file_name(&self, place: usize) -> String {
        match place {
            0 => "plant.toml".into(),
            place => format!("{}.toml", self.modules[place - 1]),
        }
    }

    fn file(&self, place: usize) -> PathBuf {
        self.folder.path().join(self.file_name(place))
    }

    fn schedule(&self) -> PathBuf {
        self.folder.path().join("schedule.toml")
    }

    /// What all processes have logged.
    #[must_use]
    pub fn logs(&self) -> String {
        let names = ["plant"].into_iter().chain(self.modules.iter().map(String::as_str));
        let log = |name| {
            let path = self.folder.path().join(format!("{name}.log"));
            format!("--- {name}\n{}", std::fs::read_to_string(path).unwrap_or_default())
        };
        names.map(log).collect()
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
        Process::start(command, &self.folder.path().join("plant.log"))
    }

    /// Starts the diagnoser of the module at `index`.
    #[must_use]
    pub fn start_diagnoser(&self, index: usize) -> Process {
        let mut command = program("trusswatch-diagnoser");
        command.arg("run").arg(self.file(index + 1));
        let log = self.folder.path().join(format!("{}.log", self.modules[index]));
        Process::start(command, &log)
    }

    /// Starts every diagnoser.
    #[must_use]
    pub fn start_diagnosers(&self) -> Vec<Process> {
        (0..self.modules.len()).map(|index| self.start_diagnoser(index)).collect()
    }
}

/// A process; killed if the test ends before it does.
pub struct Process {
    child: Child,
    log: PathBuf,
}

impl Process {
    fn start(mut command: std::process::Command, log: &Path) -> Self {
        let file = File::create(log).unwrap();
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(file);
        Self { child: command.spawn().unwrap(), log: log.to_path_buf() }
    }

    /// Its process number.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// What it has logged.
    #[must_use]
    pub fn log(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap_or_default()
    }

    /// Sends a signal.
    pub fn signal(&self, signal: Signal) {
        kill(Pid::from_raw(i32::try_from(self.child.id()).unwrap()), signal).unwrap();
    }

    /// Waits for its end and returns the exit code.
    pub async fn exit_code(&mut self) -> Option<i32> {
        let end = async {
            loop {
                if let Some(status) = self.child.try_wait().unwrap() {
                    return status.code();
                }
                tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            }
        };
        crate::in_time("the end of a process", end).await
    }

    /// Ends it with SIGTERM; it must exit with 0.
    pub async fn stop(mut self) {
        self.signal(Signal::SIGTERM);
        let code = self.exit_code().await;
        assert_eq!(code, Some(0), "{}", self.log());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Already gone, most often.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
