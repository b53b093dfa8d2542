//! Messages from the network.

use vocabulary::{Encoding, Message, Sample, decode, decode_as, encode, encode_as};

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

/// The same of a sample in CBOR, and of the steps of its block.
pub(super) fn check_cbor(bytes: &[u8]) {
    match decode_as::<Sample>(bytes, Encoding::Cbor) {
        Ok(sample) => {
            let written = encode_as(&sample, Encoding::Cbor).unwrap();
            let back: Sample = decode_as(&written, Encoding::Cbor).unwrap();
            assert_eq!(encode_as(&back, Encoding::Cbor).unwrap(), written);
            match Sample::read(bytes, Encoding::Cbor) {
                Ok(steps) => {
                    let steps: Vec<Sample> = steps.collect();
                    assert_eq!(steps.len(), sample.block.len().max(1));
                    steps.iter().for_each(|step| check::<Sample>(&encode(step).unwrap()));
                }
                Err(error) => is_bearable(&error.to_string()),
            }
        }
        Err(error) => is_bearable(&error.to_string()),
    }
}

fn text(written: &[u8]) -> &str {
    std::str::from_utf8(written).unwrap()
}
