//! Where the programs under test are.

use std::path::PathBuf;
use std::process::Command;

/// A program that was built with the tests' own profile.
///
/// # Panics
/// If it was not built.
#[must_use]
pub fn program(name: &str) -> Command {
    let mut command = Command::new(path(name));
    command.envs(shell::environment::missing());
    command
}

/// Path of a program that was built with the tests' own profile, or of one in the folder that the
/// environment variable `TRUSSWATCH_PROGRAMS` names.
///
/// # Panics
/// If it was not built.
#[must_use]
pub fn path(name: &str) -> PathBuf {
    let folder = std::env::var_os("TRUSSWATCH_PROGRAMS").map(PathBuf::from).unwrap_or_else(|| {
        let test = std::env::current_exe().unwrap();
        // target/release/deps/TEST
        test.parent().and_then(|deps| deps.parent()).unwrap().to_path_buf()
    });
    let path = folder.join(name);
    assert!(
        path.exists(),
        "{} is missing: run `cargo build --release --locked` first",
        path.display()
    );
    path
}

/// The folder of the shipped configurations.
#[must_use]
pub fn configs() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../configs")
}

/// Which of two versions of the programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Version {
    /// The one that `.ci/former` names.
    Former,
    /// The one under test.
    Present,
}

impl Version {
    /// A program of this version.
    ///
    /// # Panics
    /// If it was not built.
    #[must_use]
    pub fn program(self, name: &str) -> Command {
        match self {
            Version::Present => program(name),
            Version::Former => {
                let mut command = Command::new(former().join("bin").join(name));
                command.envs(shell::environment::missing());
                command
            }
        }
    }

    /// The folder of this version's shipped configurations.
    ///
    /// # Panics
    /// If there is no former version.
    #[must_use]
    pub fn configs(self) -> PathBuf {
        match self {
            Version::Present => configs(),
            Version::Former => former().join("configs"),
        }
    }
}

/// The folder that the environment variable `TRUSSWATCH_FORMER` names: programs of a former version in `bin`, its shipped
/// configurations in `configs`.
fn former() -> PathBuf {
    let folder = std::env::var_os("TRUSSWATCH_FORMER");
    folder.expect("TRUSSWATCH_FORMER names no folder: `.ci/upgrade` makes one").into()
}
