//! How long a message may be that a process receives.
//!
//! Zenoh puts the parts of a message together before it looks at the key or at access control, so whoever can open
//! a link can make a process keep an unfinished message of each priority. A message that is longer is dropped
//! as soon as it is known to be, without a trace; the link stays.
//!
//! What is limited are the bytes of the message. Zenoh 1.10.2 keeps each part in the buffer that it was received in:
//! a client made for it, which sends a byte at a time, still makes a process take thousands of times what it sends.
//! There is no setting against that.

use zenoh::Config;

use crate::error::NetworkError;
use crate::zenoh_file::set;

/// Longest message with everything around it \[bytes\], unless a file of Zenoh's settings says otherwise: four times
/// what the longest one of ours may have (`vocabulary::MAX_MESSAGE_BYTES`), whatever Zenoh adds.
pub const LONGEST_MESSAGE_BYTES: usize = 4 << 20;
const KEY: &str = "transport/link/rx/max_message_size";

/// Sets it where Zenoh's own default stands, 1 GiB; another length is the file's decision.
pub(crate) fn limit(config: &mut Config) -> Result<(), NetworkError> {
    if config.get_json(KEY).ok() == Config::default().get_json(KEY).ok() {
        set(config, KEY, &LONGEST_MESSAGE_BYTES.to_string())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::{Mode, Network};
    use crate::zenoh_settings::settings;

    /// What is in force for a process with these settings of its own.
    fn limit_with(text: &str) -> String {
        let mut config = Config::from_json5(text).unwrap();
        limit(&mut config).unwrap();
        config.get_json(KEY).unwrap()
    }

    #[test]
    fn no_process_receives_longer_messages() {
        let ours = LONGEST_MESSAGE_BYTES.to_string();
        for mode in [Mode::Peer, Mode::Client] {
            let config = settings(&Network { mode: Some(mode), ..Network::default() }).unwrap();
            assert_eq!(config.get_json(KEY).unwrap(), ours);
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
