//! `trusswatch generate`: manual pages and completions of all three programs, from the very command lines
//! that they take. For packagers, therefore hidden.

mod completions;
mod man;

use std::fs;
use std::path::{Path, PathBuf};

use clap::Command;

use crate::failure::Failure;

/// Write manual pages and shell completions of all programs
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// What to write
    #[arg(value_enum)]
    what: What,
    /// The directory that takes it; made if it is not there
    directory: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum What {
    /// A manual page of each program and of each of its subcommands
    Man,
    /// Completions for bash, zsh and fish, each in a directory of that name
    Completions,
}

pub(crate) fn run(
    arguments: &Arguments,
    programs: impl IntoIterator<Item = Command>,
) -> Result<(), Failure> {
    let directory = &arguments.directory;
    match arguments.what {
        What::Man => man::write(programs, directory),
        What::Completions => completions::write(programs, directory),
    }
}

/// A directory that is there afterwards.
fn make(directory: &Path) -> Result<(), Failure> {
    fs::create_dir_all(directory).map_err(|error| unwritten(directory, &error))
}

fn unwritten(path: &Path, error: &std::io::Error) -> Failure {
    Failure::runtime(format!("cannot write `{}`: {error}", path.display()))
}
