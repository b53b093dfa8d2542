//! A message with its time and step.

use serde::Deserialize;

/// A recorded message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recorded {
    /// The key that it was published on.
    pub topic: String,
    /// Its own time \[ns since 1970\].
    pub time_unix_ns: u64,
    /// Its step modulo 2³²; 0 if it has none.
    pub sequence: u32,
    /// The published bytes.
    pub payload: Vec<u8>,
}

/// The fields of a message that give its time and its order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
pub struct Stamp {
    /// Its own time \[ns since 1970\].
    #[serde(default)]
    pub time_unix_ns: Option<u64>,
    /// The run of its step.
    #[serde(default)]
    pub run: Option<u64>,
    /// Its step.
    #[serde(default)]
    pub step: Option<u64>,
    /// The process of its number.
    #[serde(default)]
    pub process: Option<u64>,
    /// Its number.
    #[serde(default)]
    pub number: Option<u64>,
}

impl Stamp {
    /// The stamp of a message; empty if the payload is not one of this program's messages.
    #[must_use]
    pub fn of(payload: &[u8]) -> Self {
        serde_json::from_slice(payload).unwrap_or_default()
    }
}

impl Recorded {
    /// A message received at this time \[ns since 1970\], which applies if the message has no time of its own.
    #[must_use]
    pub fn received(topic: String, payload: Vec<u8>, at_unix_ns: u64) -> Self {
        let stamp = Stamp::of(&payload);
        Self::stamped(topic, payload, stamp, at_unix_ns)
    }

    /// Likewise, with a stamp that has already been read.
    #[must_use]
    pub fn stamped(topic: String, payload: Vec<u8>, stamp: Stamp, at_unix_ns: u64) -> Self {
        let time_unix_ns = stamp.time_unix_ns.unwrap_or(at_unix_ns);
        let sequence = low_half(stamp.step.unwrap_or(0));
        Self { topic, time_unix_ns, sequence, payload }
    }
}

pub(crate) fn low_half(step: u64) -> u32 {
    let [a, b, c, d, ..] = step.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamp(payload: &str) -> (u64, u32) {
        let recorded = Recorded::received("t".to_owned(), payload.into(), 7);
        assert_eq!(recorded.payload, payload.as_bytes(), "verbatim");
        (recorded.time_unix_ns, recorded.sequence)
    }

    #[test]
    fn a_message_has_its_own_time_and_step_or_that_of_its_reception() {
        assert_eq!(stamp(r#"{"v":1,"step":5,"x":[1,{"step":9}],"time_unix_ns":3}"#), (3, 5));
        assert_eq!(stamp(r#"{"v":1,"step":4294967298}"#), (7, 2));
        assert_eq!(stamp(r#"{"step":null}"#), (7, 0));
        for foreign in ["", "null", r#"{"step":"x"}"#, r#"{"step":-1,"time_unix_ns":2}"#, "{"] {
            assert_eq!(stamp(foreign).0, 7, "{foreign}");
        }
    }
}
