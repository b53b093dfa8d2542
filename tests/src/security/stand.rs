//! The tower by mutual TLS and under the access control that `trusswatch pki access` prints: as a star
//! around a router, or as peers.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use daemon::config::Schedule;
use names::RunId;
use session::{Mode, Network};
use tempfile::TempDir;
use zenoh::{Config, Session};

use crate::binaries::{configs, program};
use crate::deployment::{Deployment, free_endpoint};
use crate::in_time;
use crate::operate::{Ended, ended};
use crate::process::Process;

/// The plant, then the modules, as a deployment counts them.
const PARTS: [&str; 3] = ["plant", "module1", "module2"];
/// A trace in a log takes no longer than this.
const TRACE: Duration = Duration::from_secs(30);
/// More steps than any test takes.
const FOR_LONG: u64 = 1_000_000;

/// Everything that is running, and the certificates.
pub struct Stand {
    /// Certificates of the structure's own authority.
    pub library: PathBuf,
    /// Where clients outside the structure connect.
    pub door: String,
    /// The process that enforces the rules there.
    pub guard: Process,
    deployment: Deployment,
    processes: Vec<Process>,
    _folder: TempDir,
}

/// All certificates, and the access rules.
struct Papers {
    folder: TempDir,
    library: PathBuf,
    access: PathBuf,
}

impl Papers {
    /// Makes them with the command that people use.
    async fn make(mode: &str) -> Self {
        let folder = crate::folder::temporary();
        let library = folder.path().join("pki");
        pki(&library, &["authority", "tower"]).await;
        for holder in PARTS.iter().chain(&["router.ground", "operator.ada", "observer.wall"]) {
            pki(&library, &["issue", holder, "--address", "127.0.0.1"]).await;
        }
        let tower = configs().join("tower.toml").display().to_string();
        let printed = pki(&library, &["access", &tower, "--mode", mode]).await;
        let access = folder.path().join("access.json5");
        std::fs::write(&access, printed).unwrap();
        // Issued after the rules were made: a good certificate that no rule names.
        pki(&library, &["issue", "operator.mallory"]).await;
        Self { folder, library, access }
    }

    fn of(&self, holder: &str) -> String {
        self.library.join(holder).display().to_string()
    }
}

/// What `trusswatch pki` with these words prints.
async fn pki(library: &Path, words: &[&str]) -> String {
    let mut command = program("trusswatch");
    command.arg("pki").args(words).arg("--dir").arg(library);
    let ended = ended(command).await;
    assert_eq!(ended.code, Some(0), "{words:?}: {ended:?}");
    ended.out
}

fn secure(endpoint: &str) -> String {
    endpoint.replace("tcp/", "tls/")
}

impl Stand {
    /// A star: plant and diagnosers are clients of a router.
    pub async fn star(schedule: &Schedule) -> Self {
        Self::around(schedule, Papers::make("router").await)
    }

    /// The same without access control in the router.
    pub async fn lawless_star(schedule: &Schedule) -> Self {
        let papers = Papers::make("router").await;
        let rules = std::fs::read_to_string(&papers.access).unwrap();
        let (on, off) = ("\"enabled\": true", "\"enabled\": false");
        assert_eq!(rules.matches(on).count(), 1, "the rules are switched on in one place");
        std::fs::write(&papers.access, rules.replace(on, off)).unwrap();
        Self::around(schedule, papers)
    }

    fn around(schedule: &Schedule, papers: Papers) -> Self {
        let deployment = Deployment::of_tower(schedule);
        let door = secure(&free_endpoint());
        for (place, holder) in PARTS.iter().enumerate() {
            deployment.set(place, "network", "mode", "client");
            deployment.set(place, "network", "listen", Vec::<String>::new());
            deployment.set(place, "network", "connect", vec![door.clone()]);
            deployment.set(place, "network", "tls", papers.of(holder));
        }
        let mut command = program("trusswatch");
        command.args(["router", "--listen", &door, "--zenoh"]).arg(&papers.access);
        command.arg("--tls").arg(papers.of("router.ground"));
        let guard = deployment.start_other(command, "router");
        let mut processes = deployment.start_diagnosers();
        processes.push(deployment.start_plant("real", FOR_LONG, 11, RunId(1)));
        Self { library: papers.library, door, guard, deployment, processes, _folder: papers.folder }
    }

    /// Peers: each connects to those before it, and monitoring clients connect to module 1.
    pub async fn peers(schedule: &Schedule) -> Self {
        let papers = Papers::make("peer").await;
        let deployment = Deployment::of_tower(schedule);
        let endpoints: Vec<String> = deployment.endpoints.iter().map(|e| secure(e)).collect();
        for (place, holder) in PARTS.iter().enumerate() {
            let others = endpoints[..place].to_vec();
            deployment.set(place, "network", "listen", vec![endpoints[place].clone()]);
            deployment.set(place, "network", "connect", others);
            deployment.set(place, "network", "tls", papers.of(holder));
            deployment.set(place, "network", "zenoh", papers.access.display().to_string());
        }
        // A peer without endpoints connects to those in its settings file.
        deployment.set(0, "network", "connect", vec![endpoints[1].clone()]);
        let guard = deployment.start_diagnoser(0);
        let second = deployment.start_diagnoser(1);
        let plant = deployment.start_plant("real", FOR_LONG, 11, RunId(1));
        Self {
            library: papers.library,
            door: endpoints[1].clone(),
            guard,
            deployment,
            processes: vec![second, plant],
            _folder: papers.folder,
        }
    }

    /// The settings of a session that shows itself as one of the holders.
    #[must_use]
    pub fn settings(&self, holder: &str) -> Config {
        let network = Network {
            mode: Some(Mode::Client),
            connect: vec![self.door.clone()],
            tls: Some(self.library.join(holder)),
            ..Network::default()
        };
        session::settings(&network).unwrap()
    }

    /// A session of one of the holders.
    pub async fn session(&self, holder: &str) -> Session {
        in_time(&format!("a session of {holder}"), async {
            zenoh::open(self.settings(holder)).await
        })
        .await
        .unwrap()
    }

    /// How `trusswatch` with these words ends, when run by one of the holders.
    pub async fn trusswatch(&self, holder: &str, words: &[&str]) -> Ended {
        let mut command = program("trusswatch");
        command.args(words).args(["--connect", &self.door, "--tls"]);
        command.arg(self.library.join(holder));
        if !words.contains(&"--timeout") {
            command.args(["--timeout", "30"]);
        }
        ended(command).await
    }

    /// The line of the guard's log with all of these words, as soon as there is one.
    pub async fn trace(&self, words: &[&str]) -> Option<String> {
        let start = Instant::now();
        while start.elapsed() < TRACE {
            let log = self.guard.log();
            let line = log.lines().find(|line| words.iter().all(|word| line.contains(word)));
            if let Some(line) = line {
                return Some(line.to_owned());
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        None
    }

    /// What all processes have logged.
    #[must_use]
    pub fn logs(&self) -> String {
        format!("--- guard\n{}{}", self.guard.log(), self.deployment.logs())
    }

    /// Ends everything in order.
    pub async fn clear(self) {
        for process in self.processes {
            process.stop().await;
        }
        self.guard.stop().await;
    }
}
