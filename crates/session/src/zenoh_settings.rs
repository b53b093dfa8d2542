//! Zenoh's settings for a process: those of its file, or ours; its endpoints, its certificate.

use pki::Identity;
use zenoh::Config;

use crate::network::{Mode, Network};
use crate::session::NetworkError;
use crate::zenoh_file::{
    AUTHORITY, CONNECT_CERTIFICATE, CONNECT_KEY, LISTEN_CERTIFICATE, LISTEN_KEY, from_file, json,
    set,
};

/// A blocking message that cannot be sent for this long closes the link, if it has this lease \[µs\].
#[must_use]
pub fn wait_before_close_us(lease_ms: u32) -> u64 {
    u64::from(lease_ms) * 1000 / 5
}
/// Longest time that opening a link may take \[ms\]. A handshake takes milliseconds, on a machine that starts fifty
/// processes at once seconds. One that is given up at its very end leaves a link that one side never reads and that
/// nobody closes: with 1 s a tenth of the pairs stayed apart, with 2 s a few on slower cores.
pub const OPENING_MS: u64 = 6000;
/// Longest time that accepting a link may take \[ms\]. Nothing is gained by giving up before the other side,
/// whose end ends this too.
pub const ACCEPTING_MS: u64 = 10_000;
/// Zenoh's settings for a process.
///
/// # Errors
/// An invalid file, or settings that Zenoh rejects.
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

/// Authenticates to every peer, and requires every peer to authenticate.
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

/// Explicit endpoints only, quick to notice a loss and quick to come back.
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

/// Longest message with everything around it \[bytes\], unless a file of Zenoh's settings says otherwise: four times
/// what the longest one of ours may have (`vocabulary::MAX_MESSAGE_BYTES`), whatever Zenoh adds.
///
/// Zenoh puts the parts of a message together before it looks at the key or at access control, so whoever can open
/// a link can make a process keep an unfinished message of each priority. A message that is longer is dropped
/// as soon as it is known to be, without a trace; the link stays.
///
/// What is limited are the bytes of the message. Zenoh 1.10.2 keeps each part in the buffer that it was received in:
/// a client made for it, which sends a byte at a time, still makes a process take thousands of times what it sends.
/// There is no setting against that.
pub const LONGEST_MESSAGE_BYTES: usize = 4 << 20;
const LONGEST_MESSAGE: &str = "transport/link/rx/max_message_size";

/// Sets it where Zenoh's own default stands, 1 GiB; another length is the file's decision.
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
