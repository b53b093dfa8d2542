//! One file that is several programs: each by its own name, for images in which every byte counts.

use std::ffi::OsStr;
use std::path::Path;
use std::process::ExitCode;

/// A whole program.
type Main = fn() -> ExitCode;

/// The programs by their names.
const OTHERS: [(&str, Main); 2] =
    [("trusswatch-diagnoser", daemon::diagnoser::main), ("trusswatch-plant", daemon::plant::main)];

/// The program by whose name this file was called, unless that is `trusswatch` or no name of ours.
pub(crate) fn by_name() -> Option<Main> {
    named(&std::env::args_os().next()?)
}

fn named(called: &OsStr) -> Option<Main> {
    let name = Path::new(called).file_name()?;
    OTHERS.iter().find(|(known, _)| name == *known).map(|(_, main)| *main)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_name_counts_not_the_way_there() {
        let is_other = |called: &str| named(OsStr::new(called)).is_some();
        assert!(is_other("trusswatch-diagnoser") && is_other("/bin/trusswatch-plant"));
        assert!(!is_other("/bin/trusswatch") && !is_other("trusswatch-diagnoser/other"));
        assert!(!is_other(""));
    }
}
