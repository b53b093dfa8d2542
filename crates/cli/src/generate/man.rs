//! Manual pages.

use std::path::Path;

use clap::Command;

use super::{make, unwritten};
use crate::failure::Failure;

/// Writes a page for each program and each of its subcommands.
pub(super) fn write(
    programs: impl IntoIterator<Item = Command>,
    directory: &Path,
) -> Result<(), Failure> {
    make(directory)?;
    for program in programs {
        clap_mangen::generate_to(program, directory).map_err(|e| unwritten(directory, &e))?;
    }
    Ok(())
}
