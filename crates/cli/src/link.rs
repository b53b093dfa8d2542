//! The network connection of client commands: their arguments, and the session.

use std::future::Future;
use std::path::PathBuf;
use std::time::Duration;

use session::{Mode, Network, NetworkFlags};
use tokio::runtime::{Builder, Runtime};
use vocabulary::{OperatorName, StructureName};
use zenoh::Session;

use crate::context::Context;
use crate::failure::Failure;

/// Longest timeout that may be specified.
const LONGEST_S: f64 = 3600.0;

const AFTER_HELP: &str = "\
A client (the default) connects to the first endpoint that answers and sees what that diagnoser or router \
sees. A peer connects to every endpoint.

Settings without a flag come from TRUSSWATCH_CONNECT (endpoints separated by commas), TRUSSWATCH_TLS and \
TRUSSWATCH_STRUCTURE, then from a context of ~/.config/trusswatch/client.toml or \
/etc/trusswatch/client.toml:

  default = \"site\"

  [context.site]
  connect = [\"tls/192.0.2.10:7447\"]
  tls = \"pki/operator.ada\"
  structure = \"tower\"";

/// Endpoints of the structure and timeout.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Network", after_long_help = AFTER_HELP)]
pub(crate) struct Link {
    #[command(flatten)]
    network: NetworkFlags,
    /// Client of one diagnoser or router, or peer of each endpoint
    #[arg(long, value_enum, value_name = "MODE")]
    mode: Option<Mode>,
    /// Zenoh settings (JSON5), e.g. certificates; used unchanged
    #[arg(long, value_name = "FILE")]
    zenoh: Option<PathBuf>,
    /// Only this structure [default: every structure seen]
    #[arg(long, value_name = "NAME")]
    structure: Option<StructureName>,
    /// The context of the client file to use
    #[arg(long, value_name = "NAME", env = "TRUSSWATCH_CONTEXT")]
    context: Option<String>,
    /// Longest wait for the connection, for modules to appear, and for each answer [s]
    #[arg(long, default_value = "3", value_name = "SECONDS", value_parser = seconds)]
    pub(crate) timeout: Duration,
}

/// The resolved connection: flags, environment and client file combined.
#[derive(Debug, Clone)]
pub(crate) struct LinkTarget {
    network: Network,
    /// The structure to show; otherwise all observed structures.
    pub(crate) structure: Option<StructureName>,
    /// Timeout of the connection, of the appearance of modules, and of each answer.
    pub(crate) timeout: Duration,
}

/// Parses a duration.
pub(crate) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().filter(|s| *s > 0.0 && *s <= LONGEST_S);
    let right = || format!("use seconds, more than 0 and at most {LONGEST_S}");
    seconds.map(Duration::from_secs_f64).ok_or_else(right)
}

impl Link {
    /// Resolves settings that the flags leave open.
    pub(crate) fn target(&self) -> Result<LinkTarget, Failure> {
        let NetworkFlags { listen, connect, tls } = self.network.clone();
        let (mode, zenoh, structure) = (self.mode, self.zenoh.clone(), self.structure.clone());
        let flags = Context { mode, listen, connect, tls, zenoh, structure };
        let mut merged = flags.or(Context::from_environment()?);
        if self.context.is_some() || !merged.names_a_place() {
            merged = merged.or(Context::from_file(self.context.as_deref())?);
        }
        if !merged.names_a_place() {
            return Err(Failure::usage(
                "no endpoint given; name a diagnoser or a router: \
                 `--connect tcp/HOST:PORT`, TRUSSWATCH_CONNECT, or a context of the client file",
            ));
        }
        let Context { mode, listen, connect, tls, zenoh, structure } = merged;
        let usual = if listen.is_empty() { Mode::Client } else { Mode::Peer };
        let mode = zenoh.is_none().then_some(mode.unwrap_or(usual));
        let network = Network { mode, listen, connect, zenoh, tls, lease_ms: None };
        Ok(LinkTarget { network, structure, timeout: self.timeout })
    }
}

impl LinkTarget {
    /// The operator in the certificate, if it belongs to an operator.
    pub(crate) fn operator(&self) -> Option<OperatorName> {
        self.network.operator()
    }

    /// The network configuration, for a process that waits for the network without limit.
    pub(crate) fn network(&self) -> &Network {
        &self.network
    }

    /// Opens a session.
    pub(crate) async fn open(&self) -> Result<Session, Failure> {
        session::open_within(&self.network, self.timeout)
            .await
            .map_err(|error| Failure::network(error.to_string()))
    }

    /// Opens a session, runs this with it, and always closes it.
    pub(crate) fn with_session<T>(
        &self,
        work: impl AsyncFnOnce(&Session) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        block_on(async {
            let session = self.open().await?;
            let outcome = work(&session).await;
            session::close(&session).await;
            outcome
        })
    }

    /// A name for the observed places.
    pub(crate) fn places(&self) -> String {
        let endpoints: Vec<&str> =
            self.network.connect.iter().chain(&self.network.listen).map(String::as_str).collect();
        match &self.network.zenoh {
            Some(file) if endpoints.is_empty() => format!("the endpoints of `{}`", file.display()),
            _ => endpoints.join(", "),
        }
    }

    /// The error if no module was seen.
    pub(crate) fn no_module(&self) -> Failure {
        let (places, timeout) = (self.places(), self.timeout);
        let owner =
            self.structure.as_ref().map_or_else(String::new, |name| format!(" of `{name}`"));
        Failure::network(format!("no module{owner} answered at {places} within {timeout:?}"))
    }
}

/// Runs a future that uses the network.
pub(crate) fn block_on<T>(future: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    runtime()?.block_on(future)
}

/// Likewise for the last operation of a process: does not wait for a session that is still being opened.
pub(crate) fn block_on_and_leave<T>(
    future: impl Future<Output = Result<T, Failure>>,
) -> Result<T, Failure> {
    let runtime = runtime()?;
    let outcome = runtime.block_on(future);
    runtime.shutdown_background();
    outcome
}

fn runtime() -> Result<Runtime, Failure> {
    // Zenoh needs more than one worker thread.
    Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::runtime(format!("cannot start the runtime: {error}")))
}
