//! Messages from the network.

use vocabulary::{Message, decode, encode};

use crate::refusal::is_bearable;

/// What is decoded encodes, and decodes to the same; what is not is refused in one line.
///
/// The same is compared as it is written: a missing value is read as not-a-number, which equals nothing.
pub(super) fn check<M: Message>(bytes: &[u8]) {
    match decode::<M>(bytes) {
        Ok(message) => {
            let written = encode(&message).unwrap();
            let back: M = decode(&written).unwrap_or_else(|error| {
                panic!("{error}: {}", String::from_utf8_lossy(&written));
            });
            assert_eq!(text(&encode(&back).unwrap()), text(&written));
        }
        Err(error) => is_bearable(&error.to_string()),
    }
}

fn text(written: &[u8]) -> &str {
    std::str::from_utf8(written).unwrap()
}
