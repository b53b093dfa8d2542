//! A router: passes on what others say, and enforces who may say what.
//!
//! It is a Zenoh session in the mode of a router and nothing else, for networks without Zenoh's own
//! `zenohd`. What access control refuses is told in the log. A service manager is told of progress for as
//! long as a question to nobody finds its way through the router and comes back.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use wire::keys::NOBODY;
use zenoh::Session;

use crate::config::{Network, NetworkFlags};
use crate::exit::{Failure, conclude};
use crate::session::{self, NetworkError};
use crate::shutdown::{Shutdown, ShutdownFlags};
use crate::supervision::{Supervisor, words};
use crate::{logging, runtime};

/// From one question to nobody to the next.
const EVERY: Duration = Duration::from_millis(250);
/// How long it may take until it is certain that nobody answers.
const PATIENCE: Duration = Duration::from_secs(1);

/// Runs a router with these settings of Zenoh until SIGTERM or SIGINT.
#[must_use]
pub fn main(zenoh: PathBuf, flags: NetworkFlags) -> ExitCode {
    logging::start();
    let network = Network {
        mode: None,
        listen: flags.listen,
        connect: flags.connect,
        zenoh: Some(zenoh),
        tls: flags.tls,
    };
    conclude(run(network))
}

fn run(network: Network) -> Result<(), Failure> {
    check(&network)?;
    runtime::until_done(ShutdownFlags::default(), |mut shutdown| async move {
        let supervisor = Supervisor::from_environment();
        supervisor.status(words::OPENING);
        let Some(session) = session::open_unless(&network, &mut shutdown).await? else {
            return Ok(());
        };
        tracing::info!("ready");
        supervisor.ready(words::PASSING_ON);
        serve(&session, &supervisor, shutdown).await;
        supervisor.stopping();
        session::close(&session).await;
        tracing::info!("stopped");
        Ok(())
    })
}

/// The session works by itself; that it does is seen from a question that goes through its tables.
async fn serve(session: &Session, supervisor: &Supervisor, mut shutdown: Shutdown) {
    loop {
        tokio::select! {
            () = shutdown.requested() => return,
            answered = nobody_answers(session) => if answered { supervisor.progress() },
        }
        tokio::select! {
            () = shutdown.requested() => return,
            () = tokio::time::sleep(EVERY) => {}
        }
    }
}

/// Asks a question that nobody answers, and waits until that is certain.
async fn nobody_answers(session: &Session) -> bool {
    let Ok(replies) = session.get(NOBODY).timeout(PATIENCE).await else { return false };
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
