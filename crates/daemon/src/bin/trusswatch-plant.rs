//! The simulated tower; see `daemon::plant`.

use std::process::ExitCode;

fn main() -> ExitCode {
    daemon::plant::main()
}
