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
