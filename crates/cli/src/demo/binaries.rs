//! Finding the programs that the demo runs.

use std::path::{Path, PathBuf};

use crate::failure::Failure;

/// The programs that the demo runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Binaries {
    pub(super) plant: PathBuf,
    pub(super) diagnoser: PathBuf,
}

impl Binaries {
    /// Finds them beside this program.
    pub(super) fn find() -> Result<Binaries, Failure> {
        let own = std::env::current_exe().map_err(|error| {
            Failure::runtime(format!("cannot find out where this program is: {error}"))
        })?;
        let directory = own.parent().unwrap_or(Path::new("."));
        let plant = beside(directory, "trusswatch-plant")?;
        Ok(Binaries { plant, diagnoser: beside(directory, "trusswatch-diagnoser")? })
    }
}

fn beside(directory: &Path, name: &str) -> Result<PathBuf, Failure> {
    let program = directory.join(name);
    if program.is_file() {
        return Ok(program);
    }
    Err(Failure::runtime(format!(
        "`{name}` is not beside this program in {}; build it with `cargo build --release -p daemon`",
        directory.display()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_missing_is_named_with_the_way_to_build_it() {
        let empty = tempfile::tempdir().unwrap();
        let failure = beside(empty.path(), "trusswatch-plant").unwrap_err();
        let text = format!("{failure:?}");
        assert!(text.contains("trusswatch-plant") && text.contains("cargo build"), "{text}");
    }
}
