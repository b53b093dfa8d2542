//! The command `trusswatch` as an operator types it.

use std::process::{Command, Output};

use serde_json::Value;

use crate::binaries::program;
use crate::deployment::Deployment;
use crate::in_time;

/// For whatever a command waits for, if it is to come: on a busy machine the default is too short \[s\].
const TIMEOUT: &str = "30";

/// What a command ended with.
#[derive(Debug)]
pub struct Ended {
    /// Exit code.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

impl Ended {
    /// Its output as JSON.
    ///
    /// # Panics
    /// If it is none.
    #[must_use]
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }
}

/// Runs `trusswatch` with these words and the endpoints of the diagnosers.
pub async fn trusswatch(deployment: &Deployment, words: &[&str]) -> Ended {
    let mut command = program("trusswatch");
    command.args(words).args(["--mode", "peer"]);
    wait_patiently(&mut command, words);
    for endpoint in &deployment.endpoints[1..] {
        command.args(["--connect", endpoint]);
    }
    ended(command).await
}

/// Gives a command time for what is to come, unless its own words say how much.
pub(crate) fn wait_patiently(command: &mut Command, words: &[&str]) {
    if !words.contains(&"--timeout") {
        command.args(["--timeout", TIMEOUT]);
    }
}

/// What a command ends with.
///
/// # Panics
/// If it does not end.
pub async fn ended(mut command: Command) -> Ended {
    let what = format!("the end of {command:?}");
    let output = tokio::task::spawn_blocking(move || command.output().unwrap());
    let Output { status, stdout, stderr } = in_time(&what, output).await.unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Ended { code: status.code(), out: text(stdout), err: text(stderr) }
}
