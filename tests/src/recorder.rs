//! A recorder beside a deployment, and what a replay says of its recording.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use nix::sys::signal::Signal;
use recording::{Recorded, Recording};
use tempfile::TempDir;
use vocabulary::{Key, Topic};

use crate::binaries::program;
use crate::cut_link::CutLink;
use crate::deployment::Deployment;
use crate::in_time;
use crate::interposer::Interposer;
use crate::operate::{Ended, ended};
use crate::process::Process;

/// How often its files are looked at.
const GLANCE: Duration = Duration::from_millis(50);

/// `trusswatch record` of the tower, connected to every process of a deployment.
pub struct Recorder {
    process: Process,
    folder: TempDir,
}

impl Recorder {
    /// Starts one.
    #[must_use]
    pub fn start(deployment: &Deployment) -> Self {
        Self::start_with(deployment, &[])
    }

    /// Starts one with more arguments.
    #[must_use]
    pub fn start_with(deployment: &Deployment, more: &[&str]) -> Self {
        let endpoints = &deployment.endpoints;
        Self::launch(deployment, endpoints, more, crate::folder::temporary(), None)
    }

    /// Starts one that connects to these endpoints only.
    #[must_use]
    pub fn start_at(deployment: &Deployment, endpoints: &[String]) -> Self {
        Self::launch(deployment, endpoints, &[], crate::folder::temporary(), None)
    }

    /// Starts one that reaches a process, the plant or a diagnoser in the deployment's order, by this link only.
    #[must_use]
    pub fn start_through(deployment: &Deployment, place: usize, link: &CutLink) -> Self {
        let mut endpoints = deployment.endpoints.clone();
        endpoints[place] = link.endpoint();
        Self::start_at(deployment, &endpoints)
    }

    /// Starts one whose disk is behind an interposer with these commands.
    #[must_use]
    pub fn behind_interposer(deployment: &Deployment, commands: &[&str]) -> (Self, Interposer) {
        let folder = crate::folder::temporary();
        let interposer = Interposer::of(folder.path().to_owned());
        commands.iter().for_each(|command| interposer.order(command));
        let endpoints = &deployment.endpoints;
        (Self::launch(deployment, endpoints, &[], folder, Some(&interposer)), interposer)
    }

    fn launch(
        deployment: &Deployment,
        endpoints: &[String],
        more: &[&str],
        folder: TempDir,
        interposer: Option<&Interposer>,
    ) -> Self {
        let mut command = record("tower", &folder, endpoints);
        command.args(more);
        if let Some(interposer) = interposer {
            interposer.preload(&mut command);
        }
        Self { process: deployment.start_other(command, "recorder"), folder }
    }

    /// Starts one of another structure, which logs into a folder.
    #[must_use]
    pub fn start_of(structure: &str, endpoints: &[String], logs: &Path) -> Self {
        let folder = crate::folder::temporary();
        let command = record(structure, &folder, endpoints);
        Self { process: Process::start(command, logs, "recorder"), folder }
    }

    /// Its files, oldest first.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(self.folder.path()).unwrap();
        let files = entries.map(|entry| entry.unwrap().path());
        let is_recording = |path: &PathBuf| path.extension().is_some_and(|end| end == "mcap");
        let mut files: Vec<PathBuf> = files.filter(is_recording).collect();
        files.sort();
        files
    }

    /// Its process.
    #[must_use]
    pub fn process(&self) -> &Process {
        &self.process
    }

    /// Bytes of its files so far.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let files = self.files();
        files.iter().map(|file| file.metadata().map_or(0, |metadata| metadata.len())).sum()
    }

    /// What it has written so far; of a file that is being written, as far as it can be read.
    #[must_use]
    pub fn messages(&self) -> Vec<Recorded> {
        let recordings = self.files().into_iter().filter_map(|file| Recording::open(&file).ok());
        let read = |recording: Recording| -> Vec<Recorded> {
            recording.messages().into_iter().flatten().map_while(Result::ok).collect()
        };
        recordings.flat_map(read).collect()
    }

    /// Waits until it has the configuration of these modules: from now on it hears them.
    pub async fn hears(&self, modules: &[&str]) {
        let hears = async {
            loop {
                let messages = self.messages();
                let heard =
                    |module: &&str| messages.iter().any(|one| is_configuration(one, module));
                if modules.iter().all(heard) {
                    return;
                }
                tokio::time::sleep(GLANCE).await;
            }
        };
        let what = format!("the recorder's hearing {modules:?}");
        in_time(&what, hears).await;
    }

    /// Ends it, with everything on the disk.
    pub async fn end(&mut self) {
        self.process.signal(Signal::SIGTERM);
        assert_eq!(self.process.exit_code().await, Some(0), "{}", self.process.log());
    }

    /// Has its recording replayed.
    pub async fn replay(&self, words: &[&str]) -> Ended {
        self.replay_files(&self.files().iter().collect::<Vec<_>>(), words).await
    }

    /// Has some files replayed.
    pub async fn replay_files(&self, files: &[&PathBuf], words: &[&str]) -> Ended {
        let mut command = program("trusswatch");
        command.arg("replay").args(files).args(words);
        ended(command).await
    }
}

fn record(structure: &str, into: &TempDir, endpoints: &[String]) -> Command {
    let mut command = program("trusswatch");
    command.args(["record", "--structure", structure, "--mode", "peer", "--into"]);
    command.arg(into.path());
    for endpoint in endpoints {
        command.args(["--connect", endpoint]);
    }
    command
}

fn is_configuration(message: &Recorded, wanted: &str) -> bool {
    let key = message.topic.parse();
    matches!(key, Ok(Key::Module { module, topic: Topic::Configuration, .. }) if module.as_str() == wanted)
}
