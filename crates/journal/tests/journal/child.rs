//! The test program as a process of its own, in one of its ignored tests.

use std::env;
use std::io::{BufRead, BufReader, Lines, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};

const DIRECTORY: &str = "JOURNAL_TEST_DIRECTORY";

/// A child process. It talks on standard error, which the test harness does not use.
pub(crate) struct Process {
    pub(crate) child: Child,
    pub(crate) reported: Lines<BufReader<ChildStderr>>,
}

impl Process {
    /// Starts `test`, with the journal in `directory`.
    pub(crate) fn start(test: &str, directory: &Path) -> Self {
        let mut child = Command::new(env::current_exe().unwrap())
            .args(["--exact", test, "--ignored", "--nocapture", "--test-threads=1"])
            .env(DIRECTORY, directory)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let reported = BufReader::new(child.stderr.take().unwrap()).lines();
        Self { child, reported }
    }

    /// Waits for the next line that the process reports.
    pub(crate) fn hear(&mut self) -> String {
        self.reported.next().expect("the child reports something").unwrap()
    }

    /// SIGKILL.
    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// In the child: the directory.
///
/// Its test passes only under its parent; by itself it would prove nothing.
pub(crate) fn directory() -> PathBuf {
    let directory = env::var_os(DIRECTORY);
    directory.map(PathBuf::from).expect("this is the child of another test and runs only there")
}

/// In the child: reports a line to the parent, whole or not at all.
pub(crate) fn tell(line: &str) {
    std::io::stderr().write_all(format!("{line}\n").as_bytes()).unwrap();
}
