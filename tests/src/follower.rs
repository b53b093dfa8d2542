//! `trusswatch follow`, and what it prints.

use std::io::{BufRead, BufReader};
use std::process::ChildStdout;

use serde_json::Value;
use tokio::sync::watch::Sender;

use crate::binaries::Version;
use crate::deployment::Deployment;
use crate::noted::Noted;
use crate::operate::command;
use crate::process::Process;

/// What it has printed, one object a line. The process is killed at the end.
pub type Follower = Noted<Vec<Value>, Process>;

/// Follows the diagnosers of a deployment with the program of one version.
#[must_use]
pub fn follow(version: Version, deployment: &Deployment) -> Follower {
    let (process, output) =
        Process::start_heard(command(version, deployment, &["follow", "--json"]));
    let lines = Sender::new(Vec::new());
    let noting = lines.clone();
    std::thread::spawn(move || note(output, &noting));
    Noted::by(lines, process)
}

fn note(output: ChildStdout, lines: &Sender<Vec<Value>>) {
    for line in BufReader::new(output).lines().map_while(Result::ok) {
        let line = serde_json::from_str(&line).unwrap_or(Value::String(line));
        lines.send_modify(|lines| lines.push(line));
    }
}
