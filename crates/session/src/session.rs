//! Opens sessions as configured, and closes them in bounded time.

use std::thread;
use std::time::{Duration, Instant};

use tokio::sync::mpsc::{self, error::SendError};
use zenoh::{Session, Wait};

use crate::network::{Mode, Network};
use crate::zenoh_file::{plain, set};
use crate::zenoh_settings::settings;

/// Why a session could not be opened.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// An invalid file of Zenoh's settings.
    #[error("`{file}` is not a file of Zenoh settings: {reason}")]
    File {
        /// The file.
        file: String,
        /// The cause.
        reason: String,
    },
    /// A setting that Zenoh rejects.
    #[error("Zenoh rejects `{key}` = {value}: {reason}")]
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
    /// A client's endpoints did not answer in time.
    #[error("no connection to {endpoints} within {within:?}")]
    NoAnswer {
        /// The endpoints.
        endpoints: String,
        /// How long they were given.
        within: Duration,
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

/// A client without a limit says this often that it still waits.
const SAY_EVERY: Duration = Duration::from_secs(60);
/// A client tries its next endpoint if the ones before have not answered within this time. It still accepts those.
const NEXT_AFTER: Duration = Duration::from_millis(250);

/// Opens a session. A peer does not wait for the peers it connects to; a client waits for its router without limit.
///
/// # Errors
/// Zenoh rejects the settings, or an endpoint cannot be listened on.
pub async fn open(network: &Network) -> Result<Session, NetworkError> {
    loop {
        match open_within(network, SAY_EVERY).await {
            Err(error @ NetworkError::NoAnswer { .. }) => tracing::warn!("{error}; trying again"),
            opened => return opened,
        }
    }
}

/// Opens a session; a client waits this long for its router. Of several endpoints it takes the first that answers, and
/// moves on to another when that one fails.
///
/// # Errors
/// As [`open`], or none of a client's endpoints answers in time.
pub async fn open_within(network: &Network, within: Duration) -> Result<Session, NetworkError> {
    if network.mode == Some(Mode::Client) {
        return open_client(network, within).await;
    }
    zenoh::open(settings(network)?).await.map_err(|error| {
        let reason = plain(&error);
        if network.listen.is_empty() {
            NetworkError::Open { endpoints: network.connect.join(", "), reason }
        } else {
            NetworkError::Listen { endpoints: network.listen.join(", "), reason }
        }
    })
}

/// Zenoh's client waits for its first endpoint alone until it gives up, and cannot be cancelled meanwhile. So each
/// endpoint gets an attempt of its own, as the first of all endpoints, and the first session counts.
async fn open_client(network: &Network, within: Duration) -> Result<Session, NetworkError> {
    let begun = Instant::now();
    let (sender, mut attempts) = mpsc::channel(network.connect.len().max(1));
    for first in 0..sender.max_capacity() {
        let mut connect = network.connect.clone();
        connect.rotate_left(first);
        let mut config = settings(&Network { connect, ..network.clone() })?;
        let timeout_ms = within.as_millis().max(1).to_string();
        set(&mut config, "connect/timeout_ms", &timeout_ms)?;
        let (sender, wait) =
            (sender.clone(), NEXT_AFTER * u32::try_from(first).unwrap_or(u32::MAX));
        // Zenoh blocks the thread that opens a session, and a runtime would wait for it when the process ends.
        thread::spawn(move || {
            thread::sleep(wait.min(within));
            if sender.is_closed() {
                return;
            }
            if let Err(SendError(Ok(late))) = sender.blocking_send(zenoh::open(config).wait()) {
                // It ends whether or not the other side answers.
                let _ = late.close().wait();
            }
        });
    }
    drop(sender);
    let mut reason = None;
    while let Some(attempt) = attempts.recv().await {
        match attempt {
            Ok(session) => {
                attempts.close();
                while let Some(late) = attempts.recv().await {
                    thread::spawn(move || late.map(|late| late.close().wait()));
                }
                return Ok(session);
            }
            Err(error) => reason = Some(plain(&error)),
        }
    }
    let endpoints = network.connect.join(", ");
    // Zenoh names no reason why an endpoint did not answer, only why it did not try.
    match reason.filter(|_| begun.elapsed() < within) {
        Some(reason) => Err(NetworkError::Open { endpoints, reason }),
        None => Err(NetworkError::NoAnswer { endpoints, within }),
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loopback;

    fn client_of(endpoints: &[String]) -> Network {
        Network { mode: Some(Mode::Client), ..Network::peer_of(endpoints) }
    }

    /// Long for a connection on this machine, short for a test.
    const WITHIN: Duration = Duration::from_secs(5);

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_client_takes_the_first_endpoint_that_answers_though_others_hang_or_refuse() {
        let [hanging, refusing, answering] = loopback::endpoints().unwrap();
        let address = hanging.trim_start_matches("tcp/");
        // The kernel accepts connections, but no process answers.
        let _hanging = std::net::TcpListener::bind(address).unwrap();
        let answers = Network { listen: vec![answering.clone()], ..Network::default() };
        let peer = open(&answers).await.unwrap();
        for endpoints in [
            [&hanging, &refusing, &answering],
            [&refusing, &answering, &hanging],
            [&answering, &hanging, &refusing],
        ] {
            let client = client_of(&endpoints.map(String::clone));
            let session = open_within(&client, WITHIN).await.unwrap();
            let connected: Vec<_> = session.info().peers_zid().await.collect();
            assert_eq!(connected, [peer.zid()]);
            close(&session).await;
        }
        let client = client_of(&[hanging.clone(), refusing.clone()]);
        let within = Duration::from_millis(400);
        let error = open_within(&client, within).await.unwrap_err().to_string();
        assert_eq!(error, format!("no connection to {hanging}, {refusing} within 400ms"));
        close(&peer).await;
    }
}
