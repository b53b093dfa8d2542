//! A process that subscribes to everything and stops receiving it.

use std::io::{BufRead, BufReader};
use std::process::{ChildStdout, Command};

use nix::sys::signal::Signal;

use crate::in_time;
use crate::process::Process;

/// How it stops receiving.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stall {
    /// Its callback does not return.
    Callback,
    /// The whole process is stopped.
    Process,
    /// Not yet: it goes on until it is cut off.
    Later,
}

/// The process; killed at the end.
pub struct Onlooker(Process);

impl Onlooker {
    /// Starts `program`, which connects to the endpoints, and stalls it when its first message has come.
    pub async fn stalled(program: &str, endpoints: &[String], stall: Stall) -> Self {
        let manner = if stall == Stall::Callback { "stall" } else { "listen" };
        let mut command = Command::new(program);
        command.arg(manner).args(endpoints.iter().map(|endpoint| narrow(endpoint)));
        let (process, output) = Process::start_heard(command);
        let onlooker = Self(process);
        let listening = tokio::task::spawn_blocking(move || first_line(output));
        assert_eq!(in_time("the onlooker's first message", listening).await.unwrap(), "listening");
        if stall == Stall::Process {
            onlooker.cut_off();
        }
        onlooker
    }

    /// Stops the whole process.
    pub fn cut_off(&self) {
        self.0.signal(Signal::SIGSTOP);
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
