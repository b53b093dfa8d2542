//! `trusswatch study`: campaigns of random cases in one process.

mod arguments;
mod compare;
mod conduct;
mod files;
mod recordings;
mod systems;

use arguments::StudyCommand;
pub(crate) use arguments::{Arguments, JobsArguments};
pub(crate) use conduct::stop_on_signal;

use crate::failure::Failure;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        StudyCommand::Campaign(request) => conduct::run(request),
        StudyCommand::Merge(arguments) => conduct::merge(arguments),
        StudyCommand::Compare(arguments) => compare::run(arguments),
        StudyCommand::Export(arguments) => recordings::write(arguments),
    }
}
