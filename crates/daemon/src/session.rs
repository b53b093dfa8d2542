//! The Zenoh session: as configured, found out about early, closed in bounded time.

use std::path::Path;
use std::time::Duration;

use zenoh::{Config, Session};

use crate::config::{Mode, Network};

/// A peer that is silent for this long is gone \[ms\].
const LEASE_MS: u64 = 1000;
/// A blocking message that cannot be sent for this long closes the link \[µs\].
const WAIT_BEFORE_CLOSE_US: u64 = 200_000;
/// Longest time that closing may take.
const CLOSING: Duration = Duration::from_secs(2);

/// Why there is no session.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NetworkError {
    /// A file of Zenoh's settings that is none.
    #[error("`{file}` is no file of Zenoh settings: {reason}")]
    File {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// Settings that Zenoh does not take.
    #[error("Zenoh does not take `{key}` = {value}: {reason}")]
    Setting {
        /// The setting.
        key: &'static str,
        /// Its value.
        value: String,
        /// Why.
        reason: String,
    },
    /// Someone else has the port, or there is no such address.
    #[error("cannot listen on {endpoints}: {reason}; free the port or choose another endpoint")]
    Listen {
        /// The endpoints.
        endpoints: String,
        /// Why.
        reason: String,
    },
    /// No session for another reason.
    #[error("no session can be opened ({endpoints}): {reason}")]
    Open {
        /// Where to.
        endpoints: String,
        /// Why.
        reason: String,
    },
}

/// Opens a session. A peer does not wait for those it connects to; a client waits for its router.
///
/// # Errors
/// Settings that Zenoh does not take, or an endpoint that cannot be listened on.
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

/// Closes a session, but not at any price.
pub async fn close(session: &Session) {
    match tokio::time::timeout(CLOSING, session.close()).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::warn!("the session did not close properly: {error}"),
        Err(_) => tracing::warn!("the session did not close within {CLOSING:?}"),
    }
}

/// Zenoh's settings for a process.
///
/// # Errors
/// A file that is none, or settings that Zenoh does not take.
pub fn settings(network: &Network) -> Result<Config, NetworkError> {
    let mut config = match &network.zenoh {
        Some(file) => from_file(file)?,
        None => ours(network.mode.unwrap_or_default())?,
    };
    for (key, endpoints) in
        [("listen/endpoints", &network.listen), ("connect/endpoints", &network.connect)]
    {
        if !endpoints.is_empty() {
            let quoted: Vec<String> = endpoints.iter().map(|text| format!("{text:?}")).collect();
            set(&mut config, key, &format!("[{}]", quoted.join(",")))?;
        }
    }
    Ok(config)
}

pub(crate) fn from_file(file: &Path) -> Result<Config, NetworkError> {
    Config::from_file(file).map_err(|error| NetworkError::File {
        file: file.display().to_string(),
        reason: plain(&error),
    })
}

/// Explicit endpoints only, quick to notice a loss and quick to come back.
fn ours(mode: Mode) -> Result<Config, NetworkError> {
    let mode = match mode {
        Mode::Peer => "\"peer\"",
        Mode::Client => "\"client\"",
    };
    let mut config = Config::default();
    for (key, value) in [
        ("mode", mode),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
        ("listen/endpoints", "[]"),
        ("listen/timeout_ms", "0"),
        ("listen/exit_on_failure", "true"),
        ("connect/timeout_ms", "-1"),
        ("connect/exit_on_failure", "false"),
        ("connect/retry", "{period_init_ms: 100, period_max_ms: 500, period_increase_factor: 1.5}"),
        ("transport/link/tx/lease", &LEASE_MS.to_string()),
        (
            "transport/link/tx/queue/congestion_control/block/wait_before_close",
            &WAIT_BEFORE_CLOSE_US.to_string(),
        ),
    ] {
        set(&mut config, key, value)?;
    }
    Ok(config)
}

/// What an error says, without the places in Zenoh's source where it was raised.
fn plain(error: &zenoh::Error) -> String {
    let text = error.to_string();
    let mut words = text.split(' ').peekable();
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        if word == "at" && words.peek().is_some_and(|next| next.contains(".rs:")) {
            words.next();
        } else {
            kept.push(word);
        }
    }
    kept.join(" ")
}

fn set(config: &mut Config, key: &'static str, value: &str) -> Result<(), NetworkError> {
    config.insert_json5(key, value).map_err(|error| NetworkError::Setting {
        key,
        value: value.to_owned(),
        reason: plain(&error),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn our_settings_are_taken_by_zenoh() {
        let network = Network {
            listen: vec!["tcp/127.0.0.1:7447".into()],
            connect: vec!["tcp/127.0.0.1:7448".into()],
            ..Network::default()
        };
        for mode in [Mode::Peer, Mode::Client] {
            let config = settings(&Network { mode: Some(mode), ..network.clone() }).unwrap();
            let get = |key: &str| config.get_json(key).unwrap();
            assert_eq!(get("listen/endpoints"), r#"["tcp/127.0.0.1:7447"]"#);
            assert_eq!(get("connect/endpoints"), r#"["tcp/127.0.0.1:7448"]"#);
            assert_eq!(get("scouting/multicast/enabled"), "false");
            assert_eq!(get("transport/link/tx/lease"), "1000");
        }
    }

    #[test]
    fn errors_do_not_name_places_in_the_source() {
        let error = "bad: 7 at /some/where/x.rs:61. - Caused by worse at home at y.rs:2.";
        assert_eq!(plain(&zenoh::Error::from(error)), "bad: 7 - Caused by worse at home");
    }

    #[test]
    fn a_file_that_is_no_file_of_settings_is_named() {
        let network = Network { zenoh: Some("missing.json5".into()), ..Network::default() };
        let error = settings(&network).unwrap_err();
        assert!(error.to_string().contains("missing.json5"), "{error}");
    }
}
