//! Opens sessions as configured, and closes them in bounded time.

use std::time::Duration;

use zenoh::Session;

use crate::network::{Mode, Network};
use crate::zenoh_file::plain;
use crate::zenoh_settings::settings;

/// Why a session could not be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// An invalid file of Zenoh's settings.
    #[error("`{file}` is no file of Zenoh settings: {reason}")]
    File {
        /// The file.
        file: String,
        /// The cause.
        reason: String,
    },
    /// A setting that Zenoh rejects.
    #[error("Zenoh does not take `{key}` = {value}: {reason}")]
    Setting {
        /// The setting.
        key: &'static str,
        /// Its value.
        value: String,
        /// The cause.
        reason: String,
    },
    /// The port is in use, or the address does not exist.
    #[error("cannot listen on {endpoints}: {reason}; free the port or choose another endpoint")]
    Listen {
        /// The endpoints.
        endpoints: String,
        /// The cause.
        reason: String,
    },
    /// The session could not be opened for another reason.
    #[error("no session can be opened ({endpoints}): {reason}")]
    Open {
        /// The endpoints.
        endpoints: String,
        /// The cause.
        reason: String,
    },
}

/// Timeout of closing.
const CLOSING: Duration = Duration::from_secs(2);
/// Time for the last messages to be delivered: closing a link discards data that the other side has not acknowledged,
/// because it must not block (`.cargo/config.toml`).
const LAST_MESSAGES: Duration = Duration::from_millis(50);

/// Opens a session. A peer does not wait for the peers it connects to; a client waits for its router.
///
/// # Errors
/// Zenoh rejects the settings, or an endpoint cannot be listened on.
pub async fn open(network: &Network) -> Result<Session, NetworkError> {
    let config = settings(network)?;
    zenoh::open(config).await.map_err(|error| {
        let reason = plain(&error);
        let named = |endpoints: &[String]| endpoints.join(", ");
        if network.listen.is_empty() || network.mode == Some(Mode::Client) {
            NetworkError::Open { endpoints: named(&network.connect), reason }
        } else {
            NetworkError::Listen { endpoints: named(&network.listen), reason }
        }
    })
}

/// Closes a session, with a timeout.
pub async fn close(session: &Session) {
    tokio::time::sleep(LAST_MESSAGES).await;
    match tokio::time::timeout(CLOSING, session.close()).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::warn!("the session did not close properly: {error}"),
        Err(_) => tracing::warn!("the session did not close within {CLOSING:?}"),
    }
}
