//! `trusswatch completions`, and `trusswatch generate`: manual pages and completions of all three programs, generated
//! from their command lines. The latter is for packagers and therefore hidden.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Command;
use clap_complete::{Shell, generate_to};

use crate::failure::Failure;
use crate::output;

const SHELLS: [Shell; 3] = [Shell::Bash, Shell::Zsh, Shell::Fish];

/// Write manual pages and shell completions of all programs
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// What to write
    #[arg(value_enum)]
    what: Generated,
    /// The directory that takes it; made if it is not there
    directory: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Generated {
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
        Generated::Man => write_man_pages(programs, directory),
        Generated::Completions => write_completions(programs, directory),
    }
}

/// Writes a page for each program and each of its subcommands.
fn write_man_pages(
    programs: impl IntoIterator<Item = Command>,
    directory: &Path,
) -> Result<(), Failure> {
    make(directory)?;
    for program in programs {
        clap_mangen::generate_to(program, directory)
            .map_err(|error| Failure::unwritable(directory, error))?;
    }
    Ok(())
}

/// Writes a file for each program and shell.
fn write_completions(
    programs: impl IntoIterator<Item = Command>,
    directory: &Path,
) -> Result<(), Failure> {
    for mut program in programs {
        let name = program.get_name().to_owned();
        for shell in SHELLS {
            let place = directory.join(shell.to_string());
            make(&place)?;
            generate_to(shell, &mut program, &name, &place)
                .map_err(|error| Failure::unwritable(&place, error))?;
        }
    }
    Ok(())
}

/// Creates a directory unless it exists.
fn make(directory: &Path) -> Result<(), Failure> {
    fs::create_dir_all(directory).map_err(|error| Failure::unwritable(directory, error))
}

/// Print the completions of a shell, e.g. for bash: source <(trusswatch completions bash)
#[derive(Debug, clap::Args)]
pub(crate) struct CompletionsArguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

pub(crate) fn completions(
    arguments: &CompletionsArguments,
    mut program: Command,
) -> Result<(), Failure> {
    let mut script = Vec::new();
    let name = program.get_name().to_owned();
    clap_complete::generate(arguments.shell, &mut program, name, &mut script);
    output::print(&String::from_utf8_lossy(&script))
}
