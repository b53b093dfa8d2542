//! `trusswatch router`: runs a router that enforces access control.
//!
//! It is only a Zenoh session in router mode, for networks without Zenoh's own `zenohd`. It logs access control
//! refusals. The watchdog heartbeat is sent while queries without a recipient pass through the router and return.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use session::{Network, NetworkError, NetworkFlags};
use shell::exit::{Failure, conclude};
use shell::opening::open_unless;
use shell::shutdown::{Shutdown, ShutdownFlags};
use shell::supervision::{OPENING, Supervisor};
use shell::{logging, runtime};
use vocabulary::keys::UNOWNED;
use zenoh::Session;

/// The status while the router runs.
const FORWARDING: &str = "forwarding messages under access control";
/// Interval of queries without a recipient.
const EVERY: Duration = Duration::from_millis(250);
/// Timeout of such a query.
const TIMEOUT: Duration = Duration::from_secs(1);

/// Route messages between modules, operators and observers, and enforce access control
///
/// A Zenoh router with settings like those of `trusswatch pki access`, until SIGTERM or SIGINT. It logs
/// refusals on standard error.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Zenoh's own settings (JSON5), with the mode `router`
    #[arg(long, value_name = "FILE")]
    zenoh: PathBuf,
    #[command(flatten)]
    network: NetworkFlags,
}

pub(crate) fn run(arguments: Arguments) -> ExitCode {
    logging::start();
    let NetworkFlags { listen, connect, tls } = arguments.network;
    let zenoh = Some(arguments.zenoh);
    conclude(forward(&Network { listen, connect, zenoh, tls, ..Network::default() }))
}

fn forward(network: &Network) -> Result<(), Failure> {
    check(network)?;
    runtime::until_done(ShutdownFlags::default(), |mut shutdown| async move {
        let supervisor = Supervisor::from_environment();
        supervisor.status(OPENING);
        let Some(session) = open_unless(network, &mut shutdown).await? else {
            return Ok(());
        };
        tracing::info!("ready");
        supervisor.ready(FORWARDING);
        serve(&session, &supervisor, shutdown).await;
        supervisor.stopping();
        session::close(&session).await;
        tracing::info!("stopped");
        Ok(())
    })
}

/// Monitors the session, which runs on its own: a query through its tables shows that it works.
async fn serve(session: &Session, supervisor: &Supervisor, mut shutdown: Shutdown) {
    loop {
        tokio::select! {
            () = shutdown.requested() => return,
            answered = ends_unanswered(session) => if answered { supervisor.progress() },
        }
        tokio::select! {
            () = shutdown.requested() => return,
            () = tokio::time::sleep(EVERY) => {}
        }
    }
}

/// Sends a query without a recipient and waits for its end; false if it was answered or failed.
async fn ends_unanswered(session: &Session) -> bool {
    let Ok(replies) = session.get(UNOWNED).timeout(TIMEOUT).await else { return false };
    while let Ok(reply) = replies.recv_async().await {
        if reply.result().is_err() {
            return false;
        }
    }
    true
}

fn check(network: &Network) -> Result<(), Failure> {
    let settings = session::settings(network)?;
    let mode = settings.get_json("mode").unwrap_or_default();
    if mode != "\"router\"" {
        let file =
            network.zenoh.as_deref().map_or(String::new(), |file| file.display().to_string());
        let reason = format!("its `mode` is {mode}; a router needs \"router\"");
        return Err(NetworkError::File { file, reason }.into());
    }
    Ok(network.check_certificates()?)
}
