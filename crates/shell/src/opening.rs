//! Opens a session, unless the process is asked to shut down first.

use session::{Network, NetworkError};
use zenoh::Session;

use crate::clock::unix_ns;
use crate::shutdown::Shutdown;

/// Opens a session, unless shutdown is requested first. A client waits for its router without limit and blocks while
/// doing so, hence a separate task.
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
    for words in session::expiring(&network.certificates(), unix_ns() / 1_000_000_000) {
        tracing::warn!("{words}; renew it with `trusswatch pki renew`");
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
