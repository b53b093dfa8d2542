//! The tower by mutual TLS and under the access control that `trusswatch pki access` prints: as a star
//! around a router, along a row of routers, or as peers.

use std::path::{Path, PathBuf};
use std::process::Command;

use daemon::config::Schedule;
use session::{Mode, Network};
use tempfile::TempDir;
use vocabulary::RunId;
use zenoh::{Config, Session};

use super::trace::{first_line_of, line_of};
use crate::binaries::{configs, program};
use crate::deployment::{Deployment, free_endpoint};
use crate::operate::{Ended, ended, wait_patiently};
use crate::process::Process;
use crate::{LIMIT, in_time};

/// The plant, then the modules, as a deployment counts them.
pub(super) const PARTS: [&str; 3] = ["plant", "module1", "module2"];
/// More steps than any test takes.
const FOR_LONG: u64 = 1_000_000;

/// Everything that is running, and the certificates.
pub struct Stand {
    /// Certificates of the structure's own authority.
    pub library: PathBuf,
    /// Where clients outside the structure connect: operators and whoever shows himself as module 2 at the last one,
    /// all others at the first.
    doors: Vec<String>,
    /// The processes that enforce the rules there.
    guards: Vec<Process>,
    /// The rules of each.
    access: Vec<PathBuf>,
    deployment: Deployment,
    /// The modules', then the plant; of peers, those that are no guards.
    processes: Vec<Process>,
    _folder: TempDir,
}

/// The routers of a row, from the ground up.
const ROUTERS: [&str; 3] = ["router.ground", "router.middle", "router.top"];

/// All certificates, and the access rules.
struct Papers {
    folder: TempDir,
    library: PathBuf,
    /// The rules of each router of a row, or of every peer.
    access: Vec<PathBuf>,
}

/// The rules of a router of a row: those below it and those above it are on the other sides of its links.
struct Side {
    place: usize,
    of: usize,
}

impl Side {
    /// Which router a part of the structure, or a person, is a client of.
    fn place_of(holder: &str, routers: usize) -> usize {
        match holder {
            "module1" => (routers - 1) / 2,
            "module2" | "operator.ada" => routers - 1,
            _ => 0,
        }
    }

    /// Words for `trusswatch pki access`.
    fn words(&self) -> Vec<String> {
        let holders = PARTS.iter().chain(&["operator.ada", "observer.wall"]);
        let holders: Vec<_> =
            holders.map(|holder| (*holder, Self::place_of(holder, self.of))).collect();
        let linked = |neighbour: usize, is_there: &dyn Fn(usize) -> bool| {
            let there = holders.iter().filter(|(_, place)| is_there(*place));
            let there: Vec<&str> = there.map(|(holder, _)| *holder).collect();
            let name = ROUTERS[neighbour].trim_start_matches("router.");
            ["--router".to_owned(), format!("{name}={}", there.join(","))]
        };
        let mut words = Vec::new();
        if let Some(below) = self.place.checked_sub(1) {
            words.extend(linked(below, &|place| place <= below));
        }
        if self.place + 1 < self.of {
            words.extend(linked(self.place + 1, &|place| place > self.place));
        }
        words
    }
}

impl Papers {
    /// Makes them with the command that people use: for peers.
    async fn for_peers() -> Self {
        Self::make(&[vec!["--mode".to_owned(), "peer".to_owned()]]).await
    }

    /// For so many routers in a row.
    async fn for_routers(routers: usize) -> Self {
        let words = (0..routers).map(|place| Side { place, of: routers }.words());
        Self::make(&words.collect::<Vec<_>>()).await
    }

    /// With rules as these words say.
    async fn make(rules: &[Vec<String>]) -> Self {
        let folder = crate::folder::temporary();
        let library = folder.path().join("pki");
        pki(&library, &["authority", "tower"]).await;
        for holder in PARTS.iter().chain(&ROUTERS).chain(&["operator.ada", "observer.wall"]) {
            pki(&library, &["issue", holder, "--address", "127.0.0.1"]).await;
        }
        let tower = tower();
        let mut access = Vec::new();
        for (place, own) in rules.iter().enumerate() {
            let mut words = vec!["access", &tower];
            words.extend(own.iter().map(String::as_str));
            let file = folder.path().join(format!("access-{place}.json5"));
            std::fs::write(&file, pki(&library, &words).await).unwrap();
            access.push(file);
        }
        // Issued after the rules were made: a good certificate that no rule names.
        pki(&library, &["issue", "operator.mallory"]).await;
        Self { folder, library, access }
    }

    fn of(&self, holder: &str) -> String {
        self.library.join(holder).display().to_string()
    }
}

/// What `trusswatch pki` with these words prints.
pub(super) async fn pki(library: &Path, words: &[&str]) -> String {
    let mut command = program("trusswatch");
    command.arg("pki").args(words).arg("--dir").arg(library);
    let ended = ended(command).await;
    assert_eq!(ended.code, Some(0), "{words:?}: {ended:?}");
    ended.out
}

/// The description of the tower.
fn tower() -> String {
    configs().join("tower.toml").display().to_string()
}

/// Access control, as `trusswatch pki` printed it into this file.
pub(super) fn switch_off(file: &Path) {
    let rules = std::fs::read_to_string(file).unwrap();
    let (on, off) = ("\"enabled\": true", "\"enabled\": false");
    assert_eq!(rules.matches(on).count(), 1, "the rules are switched on in one place");
    std::fs::write(file, rules.replace(on, off)).unwrap();
}

/// A router with these rules and this certificate.
pub(super) fn router(door: &str, rules: &Path, tls: &Path) -> Command {
    let mut command = program("trusswatch");
    command.args(["router", "--listen", door, "--zenoh"]).arg(rules).arg("--tls").arg(tls);
    command
}

/// The same with as few descriptors as systems give at first.
fn with_usual_limits(command: &Command) -> Command {
    let mut limited = Command::new("sh");
    limited.args(["-c", "ulimit -Sn 1024; exec \"$0\" \"$@\""]);
    limited.arg(command.get_program()).args(command.get_args());
    for (name, value) in command.get_envs() {
        limited.env(name, value.unwrap_or_default());
    }
    limited
}

/// A client that does not wait for its router for ever: Zenoh blocks the thread that opens a session until it is there.
pub(super) fn gives_up(mut settings: Config) -> Config {
    settings.insert_json5("connect/timeout_ms", &LIMIT.as_millis().to_string()).unwrap();
    settings.insert_json5("connect/exit_on_failure", "true").unwrap();
    settings
}

pub(super) fn secure(endpoint: &str) -> String {
    endpoint.replace("tcp/", "tls/")
}

impl Stand {
    /// A star: plant and diagnosers are clients of a router.
    pub async fn star(schedule: &Schedule) -> Self {
        Self::row(schedule, 1).await
    }

    /// The same without access control in the router.
    pub async fn lawless_star(schedule: &Schedule) -> Self {
        let papers = Papers::for_routers(1).await;
        switch_off(&papers.access[0]);
        Self::along(schedule, papers)
    }

    /// Up to three routers, each linked to the one below it. Who is where: see `Side::place_of`.
    pub async fn row(schedule: &Schedule, routers: usize) -> Self {
        Self::along(schedule, Papers::for_routers(routers).await)
    }

    /// As many routers as there are rules.
    fn along(schedule: &Schedule, papers: Papers) -> Self {
        let deployment = Deployment::of_tower(schedule);
        deployment.patient();
        let doors: Vec<String> = papers.access.iter().map(|_| secure(&free_endpoint())).collect();
        for (place, holder) in PARTS.iter().enumerate() {
            let door = doors[Side::place_of(holder, doors.len())].clone();
            deployment.set(place, "network", "mode", "client");
            deployment.set(place, "network", "listen", Vec::<String>::new());
            deployment.set(place, "network", "connect", vec![door]);
            deployment.set(place, "network", "tls", papers.of(holder));
        }
        let guards = papers.access.iter().enumerate().map(|(place, rules)| {
            let tls = papers.library.join(ROUTERS[place]);
            let mut command = router(&doors[place], rules, &tls);
            if let Some(below) = place.checked_sub(1) {
                command.args(["--connect", &doors[below]]);
            }
            deployment.start_other(with_usual_limits(&command), ROUTERS[place])
        });
        let guards = guards.collect();
        let mut processes = deployment.start_diagnosers();
        processes.push(deployment.start_plant("real", FOR_LONG, 11, RunId(1)));
        let Papers { library, access, folder } = papers;
        Self { library, doors, guards, access, deployment, processes, _folder: folder }
    }

    /// Revokes a holder's certificate and does in a star what is then to be done: new rules, and the router
    /// restarted with them. What was logged before is in the log still.
    pub async fn revoke(&mut self, holders: &[&str]) {
        for holder in holders {
            pki(&self.library, &["revoke", holder]).await;
        }
        let words = ["access", &tower()];
        let rules = pki(&self.library, &words).await;
        std::fs::write(&self.access[0], rules).unwrap();
        self.guards.remove(0).stop().await;
        let tls = self.library.join(ROUTERS[0]);
        let command = router(&self.doors[0], &self.access[0], &tls);
        self.guards.insert(0, self.deployment.start_other(with_usual_limits(&command), ROUTERS[0]));
    }

    /// Peers: each connects to those before it, and monitoring clients connect to module 1.
    pub async fn peers(schedule: &Schedule) -> Self {
        let papers = Papers::for_peers().await;
        let deployment = Deployment::of_tower(schedule);
        deployment.patient_but_for_leases();
        let endpoints: Vec<String> = deployment.endpoints.iter().map(|e| secure(e)).collect();
        for (place, holder) in PARTS.iter().enumerate() {
            let others = endpoints[..place].to_vec();
            deployment.set(place, "network", "listen", vec![endpoints[place].clone()]);
            deployment.set(place, "network", "connect", others);
            deployment.set(place, "network", "tls", papers.of(holder));
            deployment.set(place, "network", "zenoh", papers.access[0].display().to_string());
        }
        // A peer without endpoints connects to those in its settings file.
        deployment.set(0, "network", "connect", vec![endpoints[1].clone()]);
        let guard = deployment.start_diagnoser(0);
        let second = deployment.start_diagnoser(1);
        let plant = deployment.start_plant("real", FOR_LONG, 11, RunId(1));
        Self {
            library: papers.library,
            doors: vec![endpoints[1].clone()],
            guards: vec![guard],
            access: papers.access,
            deployment,
            processes: vec![second, plant],
            _folder: papers.folder,
        }
    }

    /// Where this holder connects.
    #[must_use]
    pub fn door_of(&self, holder: &str) -> &str {
        &self.doors[Side::place_of(holder, self.doors.len())]
    }

    /// The settings of a session that shows itself as one of the holders.
    #[must_use]
    pub fn settings(&self, holder: &str) -> Config {
        self.settings_at(self.door_of(holder), holder)
    }

    /// The same at another door.
    fn settings_at(&self, door: &str, holder: &str) -> Config {
        let network = Network {
            mode: Some(Mode::Client),
            connect: vec![door.to_owned()],
            tls: Some(self.library.join(holder)),
            ..Network::default()
        };
        gives_up(session::settings(&network).unwrap())
    }

    /// A session of one of the holders.
    pub async fn session(&self, holder: &str) -> Session {
        let opening = async { zenoh::open(self.settings(holder)).await };
        in_time(&format!("a session of {holder}"), opening).await.unwrap()
    }

    /// A session that shows itself as one of the holders at the first door.
    pub async fn session_below(&self, holder: &str) -> Session {
        let settings = self.settings_at(&self.doors[0], holder);
        let opening = async { zenoh::open(settings).await };
        in_time(&format!("a session of {holder}"), opening).await.unwrap()
    }

    /// How `trusswatch` with these words ends, when run by one of the holders.
    pub async fn trusswatch(&self, holder: &str, words: &[&str]) -> Ended {
        let mut command = program("trusswatch");
        command.args(words).args(["--connect", self.door_of(holder), "--tls"]);
        command.arg(self.library.join(holder));
        wait_patiently(&mut command, words);
        ended(command).await
    }

    /// What the guards have logged.
    #[must_use]
    pub fn guards_log(&self) -> String {
        self.guards.iter().map(Process::log).collect()
    }

    /// The process number of the first guard.
    #[must_use]
    pub fn guard_pid(&self) -> u32 {
        self.guards[0].pid()
    }

    /// The line of a guard's log with all of these words, as soon as there is one.
    pub async fn trace(&self, words: &[&str]) -> Option<String> {
        line_of(|| self.guards_log(), words).await
    }

    /// Has a guard's log a line with all of these words?
    #[must_use]
    pub fn has_trace(&self, words: &[&str]) -> bool {
        first_line_of(&self.guards_log(), words).is_some()
    }

    /// What all processes have logged.
    #[must_use]
    pub fn logs(&self) -> String {
        format!("--- guards\n{}{}", self.guards_log(), self.deployment.logs())
    }

    /// Ends everything in order.
    pub async fn clear(self) {
        for process in self.processes {
            process.stop().await;
        }
        for guard in self.guards {
            guard.stop().await;
        }
    }
}
