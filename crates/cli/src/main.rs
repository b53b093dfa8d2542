//! `trusswatch`: what a person types.

fn main() -> std::process::ExitCode {
    cli::run()
}
