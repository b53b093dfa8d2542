//! Opens a session for as long as the process is not asked to end.

use session::{Network, NetworkError};
use zenoh::Session;

use crate::shutdown::Shutdown;

/// Opens a session, unless the end is asked for before there is one: a client waits for its router as
/// long as it takes, and does so without yielding, hence the task of its own.
///
/// # Errors
/// Those of [`session::open`].
pub async fn open_unless(
    network: &Network,
    shutdown: &mut Shutdown,
) -> Result<Option<Session>, NetworkError> {
    tracing::info!(
        listen = network.listen.join(", "),
        connect = network.connect.join(", "),
        "opening a session"
    );
    let wanted = network.clone();
    for problem in network.problems_of_time() {
        tracing::warn!("{problem}");
    }
    if let Some(days) = network.identity().and_then(|identity| identity.ends_soon()) {
        tracing::warn!("the certificate ends in {days} days; renew it with `trusswatch pki renew`");
    }
    let opening = tokio::spawn(async move { session::open(&wanted).await });
    tokio::select! {
        opened = opening => match opened {
            Ok(session) => session.map(Some),
            Err(error) => Err(NetworkError::Open {
                endpoints: network.connect.join(", "),
                reason: error.to_string(),
            }),
        },
        () = shutdown.requested() => Ok(None),
    }
}
