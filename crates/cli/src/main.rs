//! `trusswatch`: the command line.

fn main() -> std::process::ExitCode {
    cli::run()
}
