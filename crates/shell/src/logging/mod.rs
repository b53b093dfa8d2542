//! Logging, filtered by an environment variable: to the journal with structured fields if a service manager connected
//! the process to it, otherwise as text to standard error.

mod endpoints;
mod journal;
mod refusals;
mod rewriting;

use std::io::IsTerminal;

pub(crate) use endpoints::with_unreachable;

use rewriting::{Rewriting, with_printable_texts};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer, Registry, fmt};

/// The environment variable with the filter, e.g. `debug` or `daemon=debug,zenoh=warn`.
pub const FILTER_VARIABLE: &str = "TRUSSWATCH_LOG";

const DEFAULT_FILTER: &str = "info,zenoh=error";

type Sink = Box<dyn Layer<Registry> + Send + Sync>;

/// Starts logging. An invalid filter is replaced by the default, with a warning.
pub fn start() {
    let wanted = std::env::var(FILTER_VARIABLE).unwrap_or_else(|_| DEFAULT_FILTER.to_owned());
    let (filter, problem) = match EnvFilter::try_new(&wanted) {
        Ok(filter) => (filter, None),
        Err(error) => (EnvFilter::new(DEFAULT_FILTER), Some(error)),
    };
    let (sink, no_journal) = sink();
    // Fails only if logging was started before, in which case nothing is left to do.
    let _ = tracing_subscriber::registry()
        .with(sink.with_filter(filter))
        .with(refusals::layer())
        .try_init();
    if let Some(error) = problem {
        tracing::warn!(
            "invalid filter `{wanted}` in {FILTER_VARIABLE}; using `{DEFAULT_FILTER}`: {error}"
        );
    }
    if let Some(error) = no_journal {
        tracing::warn!("cannot connect to journald; logging to stderr: {error}");
    }
}

/// The destination of logs; and, if the journal was expected but is not available, the error.
fn sink() -> (Sink, Option<std::io::Error>) {
    if !journal::is_connected() {
        return (standard_error(), None);
    }
    match journal::layer() {
        Ok(layer) => (Box::new(Rewriting(layer, with_printable_texts)), None),
        Err(error) => (standard_error(), Some(error)),
    }
}

fn standard_error() -> Sink {
    let ansi = std::io::stderr().is_terminal();
    // An error of writing would be printed on standard error, which panics if that is gone too.
    let layer =
        fmt::layer().with_ansi(ansi).with_writer(std::io::stderr).log_internal_errors(false);
    Box::new(Rewriting(layer, with_printable_texts))
}
