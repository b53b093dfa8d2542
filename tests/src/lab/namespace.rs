//! A network namespace and its end.

use std::fs::File;
use std::process::Command;

use nix::sched::{CloneFlags, setns};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use super::missing::Missing;
use super::program::ip;

/// Where `ip` keeps names of namespaces.
const FOLDER: &str = "/run/netns";

/// A namespace with a name; removed when it is dropped.
#[derive(Debug)]
pub(super) struct Namespace {
    name: String,
}

impl Namespace {
    pub(super) fn add(name: String) -> Result<Self, Missing> {
        let refused = |reason| Missing::new("network namespaces", reason);
        ip(&["netns", "add", &name]).map_err(refused)?;
        // From here on it is removed in any case.
        let namespace = Self { name };
        ip(&["-n", &namespace.name, "link", "set", "lo", "up"]).map_err(refused)?;
        Ok(namespace)
    }

    /// `nsenter` becomes the program, so both have the same process number and environment. Unlike
    /// `ip netns exec` it makes no mount namespace, whose end a killed process would wait for: the kernel
    /// takes seconds over it while something else computes.
    pub(super) fn command(&self, program: &Command) -> Command {
        let mut command = Command::new("nsenter");
        command.arg(format!("--net={FOLDER}/{}", self.name)).arg("--").arg(program.get_program());
        command.args(program.get_args());
        command.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
        command
    }

    /// Does something in the namespace, in a thread that ends with it: a thread's namespace is its own.
    pub(super) fn enter<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        std::thread::scope(|scope| {
            let thread = scope.spawn(|| {
                let namespace = File::open(format!("{FOLDER}/{}", self.name)).unwrap();
                setns(namespace, CloneFlags::CLONE_NEWNET).unwrap();
                work()
            });
            thread.join().unwrap()
        })
    }
}

impl Drop for Namespace {
    fn drop(&mut self) {
        // Fails if it was removed already, which is fine.
        let _ = ip(&["netns", "del", &self.name]);
    }
}

/// Names of all namespaces.
pub(super) fn existing() -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(FOLDER) else { return Vec::new() };
    entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect()
}

/// Ends the processes in an orphaned namespace, and removes it.
pub(super) fn remove_with_processes(name: &str) {
    let processes = ip(&["netns", "pids", name]).unwrap_or_default();
    for pid in processes.lines().filter_map(|line| line.trim().parse().ok()) {
        let _ = kill(Pid::from_raw(pid), Signal::SIGKILL);
    }
    let _ = ip(&["netns", "del", name]);
}
