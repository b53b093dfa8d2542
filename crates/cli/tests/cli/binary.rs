//! Running the real binary.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// What a run of the binary left behind.
pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Outcome {
    /// The run failed with this exit code and said all of these.
    #[track_caller]
    pub(crate) fn fails(&self, code: i32, said: &[&str]) {
        assert_eq!(self.code, Some(code), "{}", self.stderr);
        // Progress may stand before it.
        let is_told = self.stderr.lines().any(|line| line.starts_with("error: "));
        assert!(is_told, "{}", self.stderr);
        for text in said {
            assert!(self.stderr.contains(text), "`{text}` is not in: {}", self.stderr);
        }
    }

    /// The run succeeded and said nothing on standard error.
    #[track_caller]
    pub(crate) fn succeeds(&self) {
        assert_eq!((self.code, self.stderr.as_str()), (Some(0), ""));
    }
}

/// The binary, without what the user's own environment and client file say of the network.
pub(crate) fn trusswatch() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trusswatch"));
    command.env("XDG_CONFIG_HOME", "/nonexistent");
    for variable in ["CLIENT", "CONNECT", "CONTEXT", "STRUCTURE", "TLS"] {
        command.env_remove(format!("TRUSSWATCH_{variable}"));
    }
    command
}

/// Runs the binary with nothing on standard input.
pub(crate) fn run<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Outcome {
    outcome(trusswatch().args(arguments).stdin(Stdio::null()))
}

/// Runs the binary with this text on standard input.
pub(crate) fn run_with(input: &str, arguments: &[&str]) -> Outcome {
    let mut child = trusswatch()
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let (mut stdin, input) = (child.stdin.take().unwrap(), input.to_owned());
    // A run that stops at a mistake does not read the rest.
    let feeder = std::thread::spawn(move || drop(stdin.write_all(input.as_bytes())));
    let output = child.wait_with_output().unwrap();
    feeder.join().unwrap();
    read(output)
}

pub(crate) fn outcome(command: &mut Command) -> Outcome {
    read(command.output().unwrap())
}

fn read(output: std::process::Output) -> Outcome {
    Outcome {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// A file of the repository.
pub(crate) fn repository(path: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).join(path)
}
