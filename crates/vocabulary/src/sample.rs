//! What a module measures at one step. The data acquisition publishes this, simulated or real.

use crate::{ModuleName, RunId, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::encoding::Message;

/// A module's measurements at one step, actuators and gages in the order of its description.
///
/// A value that is missing is `null`; `NaN`, `Infinity` and other words that programs write for what is not a finite number
/// are read as `null`. The others are used; a component whose values are missing for 50 samples in
/// a row, or more than one in fifty of them, is latched with the symptom `no_signal`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sample {
    /// The module that was measured.
    pub module: ModuleName,
    /// Tells one run of the data acquisition from the next.
    pub run: RunId,
    /// The sampling instant, counted from 0 within the run.
    pub step: Step,
    /// When it was published, by the publisher's clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// Demanded force of each actuator \[N\].
    #[serde(default, deserialize_with = "values")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub demands_n: Vec<f64>,
    /// Pressures of chambers A and B of each actuator \[Pa\].
    #[serde(default, deserialize_with = "pairs")]
    #[schemars(with = "Vec<[Option<f64>; 2]>")]
    pub pressures_pa: Vec<[f64; 2]>,
    /// Elongation of each gage's member \[m\].
    #[serde(default, deserialize_with = "values")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub elongations_m: Vec<f64>,
    /// In place of the others, the reading of each channel of a learned module, in its own unit: sensors, then inputs, in
    /// the order of the module's file.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "values")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub readings: Vec<f64>,
}

impl Message for Sample {
    const WHAT: &'static str = "sample";

    /// JSON has no numbers that are not finite; Python, JavaScript libraries, C and LabVIEW write them all the same.
    fn corrected(text: &str) -> Option<String> {
        const WORDS: [&str; 3] = ["nan", "infinity", "inf"];
        let mut corrected = String::with_capacity(text.len());
        let mut rest = text;
        let mut in_string = false;
        while let Some(character) = rest.chars().next() {
            let begins = |word: &&str| {
                rest.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word))
            };
            let word = WORDS.iter().find(|word| !in_string && begins(word));
            let length = match (word, character) {
                (Some(word), _) => {
                    // `-Infinity`, `+inf`
                    corrected.truncate(corrected.trim_end_matches(['-', '+']).len());
                    corrected.push_str("null");
                    word.len()
                }
                (None, '\\') => {
                    // An escaped quote ends no string.
                    let escaped = rest.chars().nth(1).map_or(0, char::len_utf8);
                    corrected.push_str(&rest[..1 + escaped]);
                    1 + escaped
                }
                (None, other) => {
                    in_string ^= other == '"';
                    corrected.push(other);
                    other.len_utf8()
                }
            };
            rest = &rest[length..];
        }
        (corrected != text).then_some(corrected)
    }
}

fn known(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn values<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    Ok(Vec::<Option<f64>>::deserialize(deserializer)?.into_iter().map(known).collect())
}

fn pairs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 2]>, D::Error> {
    let pairs = Vec::<[Option<f64>; 2]>::deserialize(deserializer)?;
    Ok(pairs.into_iter().map(|pair| pair.map(known)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DecodeError, decode, encode};

    fn sample() -> Sample {
        Sample {
            module: "module1".parse().unwrap(),
            run: RunId(1),
            step: Step(2),
            time_unix_ns: 3,
            demands_n: vec![0.1, -1e-300],
            pressures_pa: vec![[7e6, 9.86e6], [1.0, 2.0]],
            elongations_m: vec![1.0 / 3.0],
            readings: Vec::new(),
        }
    }

    #[test]
    fn a_value_that_is_not_finite_travels_as_null_and_comes_back_as_not_a_number() {
        let mut sample = sample();
        sample.elongations_m[0] = f64::INFINITY;
        sample.pressures_pa[1][0] = f64::NAN;
        let bytes = encode(&sample).unwrap();
        let back: Sample = decode(&bytes).unwrap();
        assert!(back.elongations_m[0].is_nan() && back.pressures_pa[1][0].is_nan());
        assert_eq!(back.demands_n, sample.demands_n);
    }

    #[test]
    fn what_programs_write_for_numbers_that_are_not_finite_is_a_missing_value() {
        let text = |module: &str, values: &str| {
            format!(
                r#"{{"v": 1, "module": "{module}", "run": 1, "step": 2, "time_unix_ns": 3, "demands_n": [], "pressures_pa": [], "elongations_m": [{values}]}}"#
            )
        };
        let words = ["null", "NaN", "-NaN", "nan", "Infinity", "-Infinity", "inf", "+Inf", "-inf"];
        for word in words {
            let read: Sample = decode(text("nan", &format!("{word}, 0.5")).as_bytes()).unwrap();
            assert_eq!(read.module.as_str(), "nan");
            assert!(read.elongations_m[0].is_nan() && read.elongations_m[1] == 0.5, "{word}");
        }
        for other in ["NaN1", "infinit", "-", "1.#QNAN", "1 NaN", "NaN, 0.5]"] {
            let error = decode::<Sample>(text("m", other).as_bytes()).unwrap_err();
            assert!(matches!(error, DecodeError::Malformed(_)), "{other}: {error}");
        }
        assert!(Sample::corrected(r#"{"a\"NaN": "Infinity"}"#).is_none());
    }

    #[test]
    fn a_pair_of_pressures_has_two_values() {
        for pressures in ["[[1.0]]", "[[1.0,2.0,3.0]]", "[1.0,2.0]", "\"x\""] {
            let text = format!(
                r#"{{"v":1,"module":"m","run":1,"step":1,"time_unix_ns":1,"demands_n":[1],"pressures_pa":{pressures},"elongations_m":[]}}"#
            );
            let error = decode::<Sample>(text.as_bytes()).unwrap_err();
            assert!(matches!(error, DecodeError::WrongMessage { .. }), "{pressures}: {error}");
        }
    }
}
