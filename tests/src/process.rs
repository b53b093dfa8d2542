//! A process under the eyes of a test: started, signalled, waited for, and what it has logged.

use std::fs::File;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::Duration;

use nix::sched::{CpuSet, sched_setaffinity};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::in_time;

/// A process; killed if the test ends before it does.
pub struct Process {
    child: Child,
    /// Where it logs, unless that is the test's own standard error.
    log: Option<PathBuf>,
}

impl Process {
    /// Starts one that logs into a folder under a name. One that is started again writes on where the one
    /// before it ended.
    #[must_use]
    pub fn start(mut command: Command, folder: &Path, name: &str) -> Self {
        let log = log_file(folder, name);
        let file = File::options().append(true).create(true).open(&log).unwrap();
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(file);
        Self { child: command.spawn().unwrap(), log: Some(log) }
    }

    /// Starts one whose standard output the test reads.
    pub(crate) fn start_heard(mut command: Command) -> (Self, ChildStdout) {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let output = child.stdout.take().unwrap();
        (Self { child, log: None }, output)
    }

    /// Its process number.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// What it has logged.
    #[must_use]
    pub fn log(&self) -> String {
        self.log.as_deref().map(read).unwrap_or_default()
    }

    /// Has all its threads, those that it starts later included, share one of the processors.
    pub fn pin(&self, processor: usize) {
        let mut processors = CpuSet::new();
        processors.set(processor).unwrap();
        for thread in std::fs::read_dir(format!("/proc/{}/task", self.pid())).unwrap() {
            let thread = thread.unwrap().file_name().into_string().unwrap().parse().unwrap();
            // A thread may have ended meanwhile.
            let _ = sched_setaffinity(Pid::from_raw(thread), &processors);
        }
    }

    /// Sends a signal.
    pub fn signal(&self, signal: Signal) {
        send(self.pid(), signal);
    }

    /// Kills it at once, with SIGKILL, and waits until it is gone: on a busy machine the kernel takes its
    /// time, in which the test goes on listening.
    pub async fn crash(&mut self) {
        self.signal(Signal::SIGKILL);
        self.exit_code().await;
    }

    /// Has it not ended by itself?
    pub fn is_running(&mut self) -> bool {
        self.ended().is_none()
    }

    /// Has it ended? Then how?
    pub fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().unwrap()
    }

    /// Waits for its end and returns the exit code; none if a signal ended it.
    pub async fn exit_code(&mut self) -> Option<i32> {
        self.exit_status().await.code()
    }

    /// Waits for its end and says how it came about.
    pub async fn exit_status(&mut self) -> ExitStatus {
        let end = async {
            loop {
                if let Some(status) = self.ended() {
                    return status;
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time("the end of a process", end).await
    }

    /// Ends it with SIGTERM; it must exit with 0.
    pub async fn stop(mut self) {
        // On a busy machine it may not have begun: without a handler the signal itself would end it.
        let begun = async {
            while self.is_running() && !self.catches(Signal::SIGTERM) {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time("a handler of SIGTERM", begun).await;
        self.signal(Signal::SIGTERM);
        let code = self.exit_code().await;
        assert_eq!(code, Some(0), "{}", self.log());
    }

    /// Whether it has a handler of a signal, see proc_pid_status(5).
    fn catches(&self, signal: Signal) -> bool {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.pid()));
        let caught = status
            .unwrap_or_default()
            .lines()
            .find_map(|line| u64::from_str_radix(line.strip_prefix("SigCgt:")?.trim(), 16).ok());
        caught.is_some_and(|caught| (caught >> (signal as i32 - 1)) & 1 == 1)
    }
}

/// Is this how a process ends of which a thread has panicked? With code 1, in order; or aborted, if it panicked
/// while it held a lock of Zenoh's: whoever wants that lock next panics as well, and who does so while unwinding
/// aborts the process.
#[must_use]
pub fn is_end_by_panic(status: ExitStatus) -> bool {
    status.code() == Some(1) || status.signal() == Some(Signal::SIGABRT as i32)
}

impl Drop for Process {
    fn drop(&mut self) {
        // Already gone, most often.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a signal to the process with this number.
pub(crate) fn send(pid: u32, signal: Signal) {
    kill(Pid::from_raw(i32::try_from(pid).unwrap()), signal).unwrap();
}

/// What all processes of a name have logged into a folder.
pub(crate) fn log_of(folder: &Path, name: &str) -> String {
    read(&log_file(folder, name))
}

fn log_file(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.log"))
}

fn read(log: &Path) -> String {
    std::fs::read_to_string(log).unwrap_or_default()
}
