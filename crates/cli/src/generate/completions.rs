//! Completions for shells.

use std::path::Path;

use clap::Command;
use clap_complete::{Shell, generate_to};

use super::{make, unwritten};
use crate::failure::Failure;

const SHELLS: [Shell; 3] = [Shell::Bash, Shell::Zsh, Shell::Fish];

/// Writes a file for each program and shell.
pub(super) fn write(
    programs: impl IntoIterator<Item = Command>,
    directory: &Path,
) -> Result<(), Failure> {
    for mut program in programs {
        let name = program.get_name().to_owned();
        for shell in SHELLS {
            let place = directory.join(shell.to_string());
            make(&place)?;
            generate_to(shell, &mut program, &name, &place)
                .map_err(|error| unwritten(&place, &error))?;
        }
    }
    Ok(())
}
