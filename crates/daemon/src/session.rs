//! The Zenoh session: as configured, found out about early, closed in bounded time.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pki::Identity;
use zenoh::{Config, Session};

use crate::config::{Mode, Network};
use crate::shutdown::Shutdown;

/// A peer that is silent for this long is gone \[ms\].
pub const LEASE_MS: u64 = 1000;
/// A blocking message that cannot be sent for this long closes the link \[µs\].
pub const WAIT_BEFORE_CLOSE_US: u64 = 200_000;
/// Longest time that opening a link may take \[ms\]. The network answers in milliseconds or not at all, and
/// whoever waits longer misses that it is back. Whoever waits less pays for it when many start at once: a
/// handshake that is given up at its very end leaves a link from which one side never reads; nobody notices,
/// and the two stay apart for good.
pub const OPENING_MS: u64 = 2000;
/// Longest time that accepting a link may take \[ms\]. Nothing is gained by giving up before the other side,
/// whose end ends this too.
pub const ACCEPTING_MS: u64 = 10_000;
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
    /// Someone else has the address for health, or it is not here.
    #[error(
        "health cannot be served on {address}: {reason}; free the port or choose another address"
    )]
    Health {
        /// The address.
        address: std::net::SocketAddr,
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

/// Opens a session, unless the end is asked for before there is one: a client waits for its router as
/// long as it takes, and does so without yielding, hence the task of its own.
///
/// # Errors
/// Those of [`open`].
pub(crate) async fn open_unless(
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
    let opening = tokio::spawn(async move { open(&wanted).await });
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
    if let Some(identity) = network.identity() {
        show(&mut config, &identity)?;
    }
    Ok(config)
}

/// Zenoh's settings from a file. Paths of certificates and keys in it are relative to it.
///
/// # Errors
/// A file that is none.
pub fn from_file(file: &Path) -> Result<Config, NetworkError> {
    let mut config = Config::from_file(file).map_err(|error| NetworkError::File {
        file: file.display().to_string(),
        reason: plain(&error),
    })?;
    let folder = file.parent().unwrap_or(Path::new("."));
    for key in PATHS {
        if let Some(path) = text(&config, key).filter(|path| Path::new(path).is_relative()) {
            set(&mut config, key, &json(&folder.join(path)))?;
        }
    }
    Ok(config)
}

const AUTHORITY: &str = "transport/link/tls/root_ca_certificate";
const LISTEN_CERTIFICATE: &str = "transport/link/tls/listen_certificate";
const LISTEN_KEY: &str = "transport/link/tls/listen_private_key";
const CONNECT_CERTIFICATE: &str = "transport/link/tls/connect_certificate";
const CONNECT_KEY: &str = "transport/link/tls/connect_private_key";
const PATHS: [&str; 5] =
    [AUTHORITY, LISTEN_CERTIFICATE, LISTEN_KEY, CONNECT_CERTIFICATE, CONNECT_KEY];

/// The identities that Zenoh's settings themselves name, for listening and for connecting.
#[must_use]
pub fn identities(config: &Config) -> Vec<Identity> {
    let file = |key| text(config, key).map(PathBuf::from);
    let pairs = [(LISTEN_CERTIFICATE, LISTEN_KEY), (CONNECT_CERTIFICATE, CONNECT_KEY)];
    let mut found: Vec<Identity> = Vec::new();
    for (certificate, key) in pairs {
        if let (Some(authority), Some(certificate), Some(key)) =
            (file(AUTHORITY), file(certificate), file(key))
        {
            found.push(Identity { authority, certificate, key });
        }
    }
    found.dedup();
    found
}

/// Shows who this is to everybody, and wants to see the same of everybody.
fn show(config: &mut Config, identity: &Identity) -> Result<(), NetworkError> {
    for (key, file) in [
        (AUTHORITY, &identity.authority),
        (LISTEN_CERTIFICATE, &identity.certificate),
        (LISTEN_KEY, &identity.key),
        (CONNECT_CERTIFICATE, &identity.certificate),
        (CONNECT_KEY, &identity.key),
    ] {
        set(config, key, &json(file))?;
    }
    for (key, value) in [
        ("transport/link/protocols", "[\"tls\"]"),
        ("transport/link/tls/enable_mtls", "true"),
        ("transport/link/tls/verify_name_on_connect", "true"),
        ("transport/link/tls/close_link_on_expiration", "true"),
    ] {
        set(config, key, value)?;
    }
    Ok(())
}

/// A setting that is a text.
fn text(config: &Config, key: &str) -> Option<String> {
    serde_json::from_str(&config.get_json(key).ok()?).ok()
}

fn json(path: &Path) -> String {
    serde_json::Value::from(path.to_string_lossy()).to_string()
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
        ("transport/unicast/open_timeout", &OPENING_MS.to_string()),
        ("transport/unicast/accept_timeout", &ACCEPTING_MS.to_string()),
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
