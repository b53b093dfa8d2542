//! A library between a process and the C library, whose calls hang or fail on command: see
//! `tests/interposer/interposer.c` for the commands. The program itself is the one that is shipped.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use tempfile::TempDir;

/// Commands to one process.
pub struct Interposer {
    orders: TempDir,
    /// The process's calls on files in it are concerned.
    directory: PathBuf,
}

impl Interposer {
    /// For a process that keeps its state in this directory.
    #[must_use]
    pub fn of(directory: PathBuf) -> Self {
        Self { orders: crate::folder::temporary(), directory }
    }

    /// Stands between the C library and the process that this command starts.
    pub fn preload(&self, command: &mut Command) {
        command.env("LD_PRELOAD", library());
        command.env("INTERPOSER_DIRECTORY", &self.directory);
        command.env("INTERPOSER_ORDERS", self.orders.path());
    }

    /// Orders something, from now on.
    pub fn order(&self, what: &str) {
        std::fs::write(self.orders.path().join(what), "").unwrap();
    }

    /// Calls it off.
    pub fn call_off(&self, what: &str) {
        std::fs::remove_file(self.orders.path().join(what)).unwrap();
    }
}

/// The library, compiled once with the compiler that links Rust's programs.
fn library() -> &'static Path {
    static LIBRARY: OnceLock<(TempDir, PathBuf)> = OnceLock::new();
    let (_, library) = LIBRARY.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path().join("interposer.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("interposer/interposer.c");
        let mut compiler = Command::new("cc");
        compiler.args(["-O1", "-shared", "-fPIC", "-o"]).arg(&library).arg(source);
        assert!(compiler.status().unwrap().success(), "{compiler:?}");
        (folder, library)
    });
    library
}
