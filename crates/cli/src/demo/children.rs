//! The processes of the demo: starts, monitors and reliably stops them.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tokio::process::{Child, Command};
use tokio::signal::unix::{Signal as Signals, SignalKind, signal};
use tokio::time::{sleep, timeout};

use super::report::ChildProcess;
use crate::failure::Failure;

/// Timeout for processes to stop when asked to.
const STOP_TIMEOUT: Duration = Duration::from_secs(4);
/// Interval at which processes are polled.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// Number of a dead process's last log lines shown.
const LINES_SHOWN: usize = 12;

struct Running {
    process: ChildProcess,
    child: Child,
    log: PathBuf,
}

/// The processes of the demo.
#[derive(Default)]
pub(super) struct Children(Vec<Running>);

impl Children {
    /// Starts a process with its log in `directory`.
    pub(super) fn start(
        &mut self,
        name: &str,
        program: &Path,
        arguments: &[OsString],
        directory: &Path,
    ) -> Result<(), Failure> {
        let log = directory.join(format!("{name}.log"));
        let cannot = |what: &Path, error: std::io::Error| {
            Failure::runtime(format!("cannot start {name}: {}: {error}", what.display()))
        };
        let output = File::create(&log).map_err(|e| cannot(&log, e))?;
        let also = output.try_clone().map_err(|e| cannot(&log, e))?;
        let child = Command::new(program)
            .args(arguments)
            .envs(shell::environment::missing())
            .current_dir(directory)
            // The process ends when this end of the pipe is closed, even if the demo is killed.
            .stdin(Stdio::piped())
            .stdout(output)
            .stderr(also)
            // Ctrl-C at the terminal is for the demo, which then stops its processes in order.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()
            .map_err(|e| cannot(program, e))?;
        // A process that was just started has an id until it has been waited for.
        let pid = child.id().unwrap_or_default();
        self.0.push(Running { process: ChildProcess { name: name.to_owned(), pid }, child, log });
        Ok(())
    }

    /// The processes.
    pub(super) fn processes(&self) -> Vec<ChildProcess> {
        self.0.iter().map(|running| running.process.clone()).collect()
    }

    /// Waits for a process to end unexpectedly, and reports it.
    pub(super) async fn unexpected_end(&mut self) -> Failure {
        loop {
            for running in &mut self.0 {
                if let Ok(Some(status)) = running.child.try_wait() {
                    return report_of_end(running, status);
                }
            }
            sleep(LOOK_EVERY).await;
        }
    }

    /// Stops all processes: requests it, then kills them after a timeout or when interrupted.
    pub(super) async fn stop(mut self, interrupts: &mut Interrupts) {
        for running in &mut self.0 {
            ask_to_stop(&mut running.child);
        }
        tokio::select! {
            () = self.all_ended() => {}
            () = sleep(STOP_TIMEOUT) => {}
            () = interrupts.next() => {
                // Standard error may be closed.
                let _ = writeln!(io::stderr(), "interrupted again: killing what has not stopped");
            }
        }
        for running in &mut self.0 {
            // An error means that the process has already ended.
            let _ = running.child.start_kill();
        }
        // Killed processes end; only one that cannot be killed would block here.
        let _ = timeout(STOP_TIMEOUT, self.all_ended()).await;
    }

    async fn all_ended(&mut self) {
        for running in &mut self.0 {
            // An error means that the process was already waited for.
            let _ = running.child.wait().await;
        }
    }
}

fn ask_to_stop(child: &mut Child) {
    let pid = child.id().and_then(|id| i32::try_from(id).ok());
    if let Some(pid) = pid {
        // An error means that the process has already ended.
        let _ = kill(Pid::from_raw(pid), Signal::SIGTERM);
    }
}

fn report_of_end(running: &Running, status: ExitStatus) -> Failure {
    let log = fs::read_to_string(&running.log).unwrap_or_default();
    let mut last: Vec<&str> = log.lines().rev().take(LINES_SHOWN).collect();
    last.reverse();
    let name = &running.process.name;
    let last = if last.is_empty() { "nothing".to_owned() } else { last.join("\n  ") };
    Failure::runtime(format!("{name} ended unexpectedly ({status}); its log ended with\n  {last}"))
}

/// The signals that request a stop.
pub(super) struct Interrupts {
    interrupt: Signals,
    terminate: Signals,
    hang_up: Signals,
}

impl Interrupts {
    /// Intercepts the signals, which then do not end this process.
    pub(super) fn listen() -> Result<Interrupts, Failure> {
        let listen = |kind| {
            signal(kind)
                .map_err(|error| Failure::runtime(format!("cannot listen for signals: {error}")))
        };
        Ok(Interrupts {
            interrupt: listen(SignalKind::interrupt())?,
            terminate: listen(SignalKind::terminate())?,
            hang_up: listen(SignalKind::hangup())?,
        })
    }

    /// Waits for the next signal.
    pub(super) async fn next(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
            _ = self.hang_up.recv() => {}
        }
    }
}
