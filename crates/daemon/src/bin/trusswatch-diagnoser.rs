//! Fault diagnosis of one module; see `daemon::diagnoser`.

use std::process::ExitCode;

fn main() -> ExitCode {
    daemon::diagnoser::main()
}
