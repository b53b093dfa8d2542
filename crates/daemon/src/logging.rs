//! Logs go to standard error, filtered by the environment.

use std::io::IsTerminal;

use tracing_subscriber::EnvFilter;

/// The environment variable with the filter, e.g. `debug` or `daemon=debug,zenoh=warn`.
pub(crate) const FILTER_VARIABLE: &str = "TRUSSWATCH_LOG";

const DEFAULT_FILTER: &str = "info,zenoh=error";

/// Starts logging. A filter that is none is replaced by the default, and that is said.
pub(crate) fn start() {
    let wanted = std::env::var(FILTER_VARIABLE).unwrap_or_else(|_| DEFAULT_FILTER.to_owned());
    let (filter, problem) = match EnvFilter::try_new(&wanted) {
        Ok(filter) => (filter, None),
        Err(error) => (EnvFilter::new(DEFAULT_FILTER), Some(error)),
    };
    let subscriber = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr);
    // Fails only if logging was started before, and then there is nothing to do.
    let _ = subscriber.try_init();
    if let Some(error) = problem {
        tracing::warn!("{FILTER_VARIABLE} is `{wanted}`, which is no filter: {error}");
    }
}
