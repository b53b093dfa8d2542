//! Zenoh's configuration for a process, from its file or from trusswatch: endpoints, certificate, timeouts.

use pki::Identity;
use zenoh::Config;

use crate::network::{Mode, Network};
use crate::session::NetworkError;
use crate::zenoh_file::{
    AUTHORITY, CONNECT_CERTIFICATE, CONNECT_KEY, LISTEN_CERTIFICATE, LISTEN_KEY, from_file, json,
    set,
};

/// How long a blocking message may be delayed before it closes a link with this lease \[µs\].
#[must_use]
pub fn wait_before_close_us(lease_ms: u32) -> u64 {
    u64::from(lease_ms) * 1000 / 5
}
/// Timeout for opening a link \[ms\]. A handshake takes milliseconds, but seconds on a machine that starts fifty
/// processes at once. A handshake that times out at its very end leaves a link that one side never reads and neither
/// side closes: with 1 s a tenth of the pairs stayed disconnected, with 2 s a few on slower cores.
pub const OPENING_MS: u64 = 6000;
/// Timeout for accepting a link \[ms\]. Timing out before the other side gains nothing, and when the other side times
/// out, this one ends too.
pub const ACCEPTING_MS: u64 = 10_000;
/// Zenoh's configuration for a process.
///
/// # Errors
/// The file is invalid, or Zenoh rejects the settings.
pub fn settings(network: &Network) -> Result<Config, NetworkError> {
    let mut config = match &network.zenoh {
        Some(file) => from_file(file)?,
        None => ours(network.mode.unwrap_or_default(), network.lease_ms())?,
    };
    limit_message_length(&mut config)?;
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

/// Configures mutual TLS: the process authenticates to every peer and requires the same of it.
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

/// The default configuration: explicit endpoints only, fast detection of losses and fast reconnection.
fn ours(mode: Mode, lease_ms: u32) -> Result<Config, NetworkError> {
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
        ("transport/link/tx/lease", &lease_ms.to_string()),
        (
            "transport/link/tx/queue/congestion_control/block/wait_before_close",
            &wait_before_close_us(lease_ms).to_string(),
        ),
    ] {
        set(&mut config, key, value)?;
    }
    Ok(config)
}

/// Longest message received, including framing \[bytes\], unless a file of Zenoh's settings specifies another length:
/// four times the longest message of trusswatch (`vocabulary::MAX_MESSAGE_BYTES`), which leaves room for Zenoh's
/// overhead.
///
/// Zenoh reassembles a message before it looks at the key or at access control, so any client that can open a link can
/// make a process keep an unfinished message of each priority. A message that exceeds the limit is dropped as soon as
/// it does, without a log entry; the link stays.
///
/// The limit counts the bytes of the message. Zenoh 1.10.2 keeps each fragment in its receive buffer, so a malicious
/// client that sends one byte at a time still makes a process allocate thousands of times what it sends. Zenoh has no
/// setting against that.
pub const LONGEST_MESSAGE_BYTES: usize = 4 << 20;
const LONGEST_MESSAGE: &str = "transport/link/rx/max_message_size";

/// Sets the limit if the length is Zenoh's default, 1 GiB; any other length was chosen in the file.
fn limit_message_length(config: &mut Config) -> Result<(), NetworkError> {
    if config.get_json(LONGEST_MESSAGE).ok() == Config::default().get_json(LONGEST_MESSAGE).ok() {
        set(config, LONGEST_MESSAGE, &LONGEST_MESSAGE_BYTES.to_string())?;
    }
    Ok(())
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
        let slow = settings(&Network { lease_ms: Some(5000), ..network }).unwrap();
        assert_eq!(slow.get_json("transport/link/tx/lease").unwrap(), "5000");
        let wait = "transport/link/tx/queue/congestion_control/block/wait_before_close";
        assert_eq!(slow.get_json(wait).unwrap(), "1000000");
    }

    #[test]
    fn a_file_that_is_no_file_of_settings_is_named() {
        let network = Network { zenoh: Some("missing.json5".into()), ..Network::default() };
        let error = settings(&network).unwrap_err();
        assert!(error.to_string().contains("missing.json5"), "{error}");
    }

    /// What is in force for a process with these settings of its own.
    fn limit_with(text: &str) -> String {
        let mut config = Config::from_json5(text).unwrap();
        limit_message_length(&mut config).unwrap();
        config.get_json(LONGEST_MESSAGE).unwrap()
    }

    #[test]
    fn no_process_receives_longer_messages() {
        let ours = LONGEST_MESSAGE_BYTES.to_string();
        for mode in [Mode::Peer, Mode::Client] {
            let config = settings(&Network { mode: Some(mode), ..Network::default() }).unwrap();
            assert_eq!(config.get_json(LONGEST_MESSAGE).unwrap(), ours);
        }
        assert_eq!(limit_with("{ mode: \"router\" }"), ours);
    }

    #[test]
    fn a_file_may_say_otherwise() {
        for bytes in ["65536", "8388608"] {
            let receiving = format!("{{ rx: {{ max_message_size: {bytes} }} }}");
            let text = format!("{{ transport: {{ link: {receiving} }} }}");
            assert_eq!(limit_with(&text), bytes);
        }
    }
}
