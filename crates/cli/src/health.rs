//! `trusswatch health`: queries the health of one process, as a container without `curl` does.

use std::io::Write;
use std::time::Duration;

use shell::health::{ProbeKind, probe};

use crate::failure::Failure;
use crate::link::{block_on, seconds};
use crate::output;

const AFTER_HELP: &str = "\
Exit codes: 0 healthy, 1 not healthy (the reason is printed), 4 no answer.";

/// Query the health of one process
///
/// A diagnoser is ready as long as it is in service, a plant as long as it computes steps. The process has
/// to be configured to serve its health: `listen` in the table `[health]`, or `--health`.
#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Arguments {
    /// Where the process serves its health, e.g. 127.0.0.1:9464
    #[arg(value_name = "ADDRESS", value_parser = host_and_port)]
    address: String,
    /// Check liveness only
    #[arg(long)]
    live: bool,
    /// Longest wait for the answer [s]
    #[arg(long, default_value = "2", value_name = "SECONDS", value_parser = seconds)]
    timeout: Duration,
}

fn host_and_port(text: &str) -> Result<String, String> {
    let port = text.rsplit_once(':').filter(|(host, _)| !host.is_empty()).map(|(_, port)| port);
    let is_port = port.is_some_and(|port| port.parse::<u16>().is_ok());
    is_port.then(|| text.to_owned()).ok_or_else(|| "use HOST:PORT, e.g. 127.0.0.1:9464".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let kind = if arguments.live { ProbeKind::Live } else { ProbeKind::Ready };
    let condition = block_on(async {
        let answer = probe(&arguments.address, kind, arguments.timeout);
        answer.await.map_err(|error| Failure::network(error.to_string()))
    })?;
    writeln!(output::stdout(), "{}", condition.words)?;
    if condition.well { Ok(()) } else { Err(Failure::reported()) }
}
