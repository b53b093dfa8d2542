//! From snippets to references, and into their files.

use std::fs;
use std::path::{Path, PathBuf};

use diagnosis::ModuleSetup;
use diagnosis::state::{Reference, Snippet};
use study::commissioning::learn;

use crate::failure::Failure;
use shell::clock::unix_ns;
use vocabulary::words::utc;

/// What a module's reference is, and where it was written.
#[derive(Debug)]
pub(super) struct Written {
    pub(super) reference: Reference,
    pub(super) file: PathBuf,
}

/// Learns the reference of every module.
pub(super) fn learn_all(
    setups: &[ModuleSetup],
    snippets: &[Snippet],
    false_alarms_per_hour: f64,
) -> Result<Vec<Reference>, Failure> {
    let reference = |(place, setup): (usize, &ModuleSetup)| {
        learn(setups, place, snippets, false_alarms_per_hour)
            .map_err(|error| Failure::input(format!("`{}`: {error}", setup.module)))
    };
    setups.iter().enumerate().map(reference).collect()
}

/// Writes each into a file of its own; `provenance` says how all were made.
pub(super) fn write(
    directory: &Path,
    references: Vec<Reference>,
    provenance: &str,
) -> Result<Vec<Written>, Failure> {
    let day: String = utc(unix_ns()).chars().take_while(|c| *c != 'T').collect();
    let write = |reference: Reference| {
        let file = directory.join(format!("{}.toml", reference.module));
        let text =
            toml::to_string(&reference).map_err(|error| Failure::runtime(error.to_string()))?;
        let head = format!(
            "# What module `{}` measures while it is healthy; written on {day} by\n# {provenance}\n",
            reference.module
        );
        fs::write(&file, head + &text).map_err(|error| {
            Failure::runtime(format!("cannot write {}: {error}", file.display()))
        })?;
        Ok(Written { reference, file })
    };
    references.into_iter().map(write).collect()
}
