//! `trusswatch study`: campaigns of random cases in one process.

mod arguments;
mod compare;
mod conduct;
mod files;
mod interrupt;
mod recordings;
mod systems;

pub(crate) use arguments::Arguments;
use arguments::Command;

use crate::failure::Failure;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Command::Campaign(request) => conduct::run(request),
        Command::Merge(arguments) => conduct::merge(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Export(arguments) => recordings::write(arguments),
    }
}
