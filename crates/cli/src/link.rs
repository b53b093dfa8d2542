//! The operator's way onto the network: what the commands take for it, and the session.

use std::future::Future;
use std::path::PathBuf;
use std::time::Duration;

use daemon::config::{Mode, Network, NetworkFlags, endpoint};
use daemon::observer::AttendanceError;
use daemon::session;
use truss::ids::StructureName;
use zenoh::Session;

use crate::failure::Failure;

/// Longest time that may be waited for anything.
const LONGEST_S: f64 = 3600.0;

const AFTER_HELP: &str = "\
With a single endpoint to connect to, this is the client of whoever is there, a diagnoser or a router, \
and sees what that one sees. With several, or when listening, it is a peer of each.";

/// Where the structure is, and for how long it is waited for.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Network", after_long_help = AFTER_HELP)]
pub(crate) struct Link {
    #[command(flatten)]
    network: NetworkFlags,
    /// Zenoh's own settings (JSON5), e.g. certificates; used as they are
    #[arg(long, value_name = "FILE")]
    zenoh: Option<PathBuf>,
    /// Only this structure; otherwise every one that is seen
    #[arg(long, value_name = "NAME")]
    pub(crate) structure: Option<StructureName>,
    /// Longest wait for the connection, for a sign of life, and for each answer [s]
    #[arg(long, default_value = "3", value_name = "SECONDS", value_parser = seconds)]
    pub(crate) timeout: Duration,
}

/// Reads a span of time.
pub(crate) fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse::<f64>().ok().filter(|s| *s > 0.0 && *s <= LONGEST_S);
    let right = || format!("use seconds, more than 0 and at most {LONGEST_S}");
    seconds.map(Duration::from_secs_f64).ok_or_else(right)
}

impl Link {
    /// Opens a session.
    pub(crate) async fn open(&self) -> Result<Session, Failure> {
        let network = self.network()?;
        if network.mode == Some(Mode::Client) {
            return self.open_as_client(&network).await;
        }
        session::open(&network).await.map_err(unusable)
    }

    /// A client waits for whom it is the client of, for ever if its settings let it: opening a session
    /// cannot be given up from outside.
    async fn open_as_client(&self, network: &Network) -> Result<Session, Failure> {
        let mut settings = session::settings(network).map_err(unusable)?;
        let timeout_ms = self.timeout.as_millis().max(1).to_string();
        settings.insert_json5("connect/timeout_ms", &timeout_ms).map_err(unusable)?;
        // Zenoh's own words are about its source.
        zenoh::open(settings).await.map_err(|_| {
            let (places, timeout) = (self.places(), self.timeout);
            Failure::network(format!("no connection to {places} within {timeout:?}"))
        })
    }

    /// How the places looked at are called.
    pub(crate) fn places(&self) -> String {
        let endpoints: Vec<&str> =
            self.network.connect.iter().chain(&self.network.listen).map(String::as_str).collect();
        match &self.zenoh {
            Some(file) if endpoints.is_empty() => format!("the endpoints of `{}`", file.display()),
            _ => endpoints.join(", "),
        }
    }

    /// Nobody was there.
    pub(crate) fn nobody(&self) -> Failure {
        let (places, timeout) = (self.places(), self.timeout);
        let whose =
            self.structure.as_ref().map_or_else(String::new, |name| format!(" of `{name}`"));
        Failure::network(format!(
            "no module{whose} gave a sign of life at {places} within {timeout:?}"
        ))
    }

    fn network(&self) -> Result<Network, Failure> {
        let NetworkFlags { listen, connect, tls } = self.network.clone();
        if let Some(error) = listen.iter().chain(&connect).find_map(|text| endpoint(text).err()) {
            return Err(Failure::input(error.to_string()));
        }
        if self.zenoh.is_some() {
            return Ok(Network { mode: None, listen, connect, zenoh: self.zenoh.clone(), tls });
        }
        let mode = match (&listen[..], &connect[..]) {
            ([], []) => {
                let right =
                    "name an endpoint of a diagnoser or a router, `--connect tcp/HOST:PORT`";
                return Err(Failure::usage(format!("nowhere to look; {right}")));
            }
            ([], [_]) => Mode::Client,
            _ => Mode::Peer,
        };
        Ok(Network { mode: Some(mode), listen, connect, zenoh: None, tls })
    }
}

/// Runs what has to do with the network.
pub(crate) fn block_on<T>(future: impl Future<Output = Result<T, Failure>>) -> Result<T, Failure> {
    // Zenoh needs more than one worker thread.
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| Failure::runtime(format!("cannot start the runtime: {error}")))?;
    runtime.block_on(future)
}

fn unusable(error: impl std::fmt::Display) -> Failure {
    Failure::network(error.to_string())
}

/// The network refuses.
pub(crate) fn refused(error: AttendanceError) -> Failure {
    unusable(error)
}
