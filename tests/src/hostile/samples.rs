//! Samples that must not be accepted as measurements, and the counter of each.

use serde_json::{Value, json};

/// The counter that a hostile sample belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Fate {
    /// Not text, not JSON, too long.
    Malformed,
    /// No version, or an unknown one.
    UnknownVersion,
    /// JSON, but not a sample.
    WrongMessage,
    /// Another module's.
    OtherModule,
    /// Well-formed, but not from the publisher that is being diagnosed.
    OtherSource,
}

/// A hostile sample.
#[derive(Debug, Clone)]
pub struct HostileSample {
    /// What is published.
    pub bytes: Vec<u8>,
    /// The counter it belongs to.
    pub fate: Fate,
}

impl HostileSample {
    fn new(fate: Fate, bytes: impl Into<Vec<u8>>) -> Self {
        Self { bytes: bytes.into(), fate }
    }

    /// A true sample with one field changed.
    fn changed(sample: &Value, fate: Fate, key: &str, value: Value) -> Self {
        let mut sample = sample.clone();
        sample[key] = value;
        Self::new(fate, serde_json::to_vec(&sample).unwrap())
    }
}

/// Short ones, made from a true sample.
#[must_use]
pub fn hostile_samples(sample: &Value) -> Vec<HostileSample> {
    let with = |fate, key: &str, value| HostileSample::changed(sample, fate, key, value);
    let nulls = |key: &str| json!(vec![Value::Null; sample[key].as_array().map_or(0, Vec::len)]);
    let step = sample["step"].as_u64().unwrap();
    let text = serde_json::to_vec(sample).unwrap();
    vec![
        HostileSample::new(Fate::Malformed, "{\"v\":1,"),
        HostileSample::new(Fate::Malformed, ""),
        HostileSample::new(Fate::Malformed, vec![0xff; 300]),
        HostileSample::new(Fate::Malformed, vec![b'['; 3000]),
        HostileSample::new(Fate::Malformed, &text[..text.len() / 2]),
        HostileSample::new(Fate::UnknownVersion, "{}"),
        with(Fate::UnknownVersion, "v", json!(7)),
        with(Fate::UnknownVersion, "v", json!("1")),
        HostileSample::new(Fate::WrongMessage, "[1]"),
        with(Fate::WrongMessage, "step", json!(-1)),
        with(Fate::WrongMessage, "module", json!("../module1")),
        with(Fate::WrongMessage, "pressures_pa", json!([[1.0]])),
        with(Fate::OtherModule, "module", json!("module2")),
        with(Fate::OtherSource, "run", json!(0)),
        with(Fate::OtherSource, "run", json!(u64::MAX)),
        with(Fate::OtherSource, "step", json!(u64::MAX)),
        with(Fate::OtherSource, "step", json!(0)),
        with(Fate::OtherSource, "step", json!(step + 1_000_000)),
        with(Fate::OtherSource, "demands_n", json!([])),
        with(Fate::OtherSource, "elongations_m", json!(vec![0.0; 500])),
        with(Fate::OtherSource, "elongations_m", nulls("elongations_m")),
        with(Fate::OtherSource, "demands_n", nulls("demands_n")),
    ]
}

/// About 64 KiB each.
#[must_use]
pub fn long_samples(sample: &Value) -> Vec<HostileSample> {
    const BYTES: usize = 1 << 16;
    let with = |fate, key: &str, value| HostileSample::changed(sample, fate, key, value);
    vec![
        HostileSample::new(Fate::Malformed, vec![b'['; BYTES]),
        HostileSample::new(Fate::Malformed, vec![0; BYTES]),
        with(Fate::UnknownVersion, "v", json!("x".repeat(BYTES))),
        with(Fate::WrongMessage, "module", json!("m".repeat(BYTES))),
        with(Fate::OtherSource, "elongations_m", json!(vec![0; BYTES / 2])),
        with(Fate::OtherSource, "colour", json!("x".repeat(BYTES))),
    ]
}

/// Longer than a message may be.
#[must_use]
pub fn oversized_sample() -> HostileSample {
    HostileSample::new(Fate::Malformed, vec![b' '; vocabulary::MAX_MESSAGE_BYTES + 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::DecodeError;

    fn true_sample() -> Value {
        json!({"v": 1, "module": "module1", "run": 1, "step": 5, "time_unix_ns": 1,
            "demands_n": [1.0], "pressures_pa": [[1.0, 2.0]], "elongations_m": [0.0]})
    }

    fn fate(bytes: &[u8]) -> Fate {
        match vocabulary::decode::<vocabulary::Sample>(bytes) {
            Ok(sample) if sample.module.as_str() != "module1" => Fate::OtherModule,
            Ok(_) => Fate::OtherSource,
            Err(DecodeError::NoVersion | DecodeError::UnknownVersion(_)) => Fate::UnknownVersion,
            Err(DecodeError::WrongMessage { .. }) => Fate::WrongMessage,
            Err(_) => Fate::Malformed,
        }
    }

    #[test]
    fn no_hostile_sample_is_the_true_one_and_each_is_what_it_is_called() {
        let sample = true_sample();
        let long = long_samples(&sample);
        for hostile in hostile_samples(&sample).into_iter().chain(long).chain([oversized_sample()])
        {
            assert_ne!(hostile.bytes, serde_json::to_vec(&sample).unwrap());
            let start =
                String::from_utf8_lossy(&hostile.bytes).chars().take(80).collect::<String>();
            assert_eq!(hostile.fate, fate(&hostile.bytes), "{start}");
        }
    }
}
