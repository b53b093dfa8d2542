//! A process that subscribes to everything and stops taking it.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::in_time;

/// How it stops taking.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stall {
    /// Its callback does not return.
    Callback,
    /// The whole process is stopped.
    Process,
}

/// The process; killed at the end.
pub struct Onlooker(Child);

impl Onlooker {
    /// Starts `program`, which connects to the endpoints, and stalls it when its first message has come.
    pub async fn stalled(program: &str, endpoints: &[String], stall: Stall) -> Self {
        let manner = if stall == Stall::Callback { "stall" } else { "listen" };
        let mut command = Command::new(program);
        command.arg(manner).args(endpoints.iter().map(|endpoint| narrow(endpoint)));
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let output = child.stdout.take().unwrap();
        let onlooker = Self(child);
        let listening = tokio::task::spawn_blocking(move || first_line(output));
        assert_eq!(in_time("the onlooker's first message", listening).await.unwrap(), "listening");
        if stall == Stall::Process {
            let pid = Pid::from_raw(i32::try_from(onlooker.0.id()).unwrap());
            kill(pid, Signal::SIGSTOP).unwrap();
        }
        onlooker
    }
}

impl Drop for Onlooker {
    fn drop(&mut self) {
        // Already gone, most often.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// With little room at the receiver, so that the sender's fills soon.
fn narrow(endpoint: &str) -> String {
    format!("{endpoint}#so_rcvbuf=16384")
}

fn first_line(output: ChildStdout) -> String {
    let mut line = String::new();
    BufReader::new(output).read_line(&mut line).unwrap();
    line.trim().to_owned()
}
