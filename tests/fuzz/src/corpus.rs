//! The kept inputs.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Where the inputs of a target are.
#[must_use]
pub fn directory(target: &str) -> PathBuf {
    root().join(target)
}

/// The names of all targets that inputs are kept for.
#[must_use]
pub fn recorded_targets() -> BTreeSet<String> {
    let entries = fs::read_dir(root()).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

/// The kept inputs of a target, with their paths, in the order of their names.
#[must_use]
pub fn inputs(target: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let Ok(entries) = fs::read_dir(directory(target)) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), fs::read(&path).unwrap())).collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus")
}
