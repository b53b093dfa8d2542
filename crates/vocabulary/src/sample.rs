//! What a module measures at one step. The data acquisition publishes this, simulated or real.

use std::fmt;

use crate::{ModuleName, RunId, Step};
use schemars::JsonSchema;
use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::encoding::Message;

/// A module's measurements at one step, actuators and gages in the order of its description.
///
/// A value that is missing is `null`; `NaN`, `Infinity` and other words that programs write for what is not a finite number,
/// bare or as text, and numbers too large for 64 bits (`1e999`) are read as `null`. The others are used; a component whose values are missing for 50 samples in
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
        let mut corrected = String::with_capacity(text.len());
        let mut rest = text;
        let mut in_string = false;
        while let Some(character) = rest.chars().next() {
            let missing = if in_string { None } else { missing_value(rest) };
            let length = match (missing, character) {
                (Some(length), _) => {
                    // `-Infinity`, `+inf`, `-1e999`
                    corrected.truncate(corrected.trim_end_matches(['-', '+']).len());
                    corrected.push_str("null");
                    length
                }
                (None, '\\') => {
                    // An escaped quote ends no string.
                    let escaped = rest.chars().nth(1).map_or(0, char::len_utf8);
                    corrected.push_str(&rest[..1 + escaped]);
                    1 + escaped
                }
                (None, digit) if !in_string && digit.is_ascii_digit() => {
                    let length = number_length(rest);
                    corrected.push_str(&rest[..length]);
                    length
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

/// What programs write for numbers that are not finite, in small letters and without a sign.
const NOT_FINITE: [&str; 3] = ["nan", "infinity", "inf"];

/// Length of the non-finite number that a text begins with: a word, or digits that overflow.
fn missing_value(text: &str) -> Option<usize> {
    let begins =
        |word: &&&str| text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    let number = &text[..number_length(text)];
    let overflows =
        number.starts_with(|c: char| c.is_ascii_digit()) && number.parse() == Ok(f64::INFINITY);
    let word = NOT_FINITE.iter().find(begins).map(|word| word.len());
    word.or(overflows.then_some(number.len()))
}

fn number_length(text: &str) -> usize {
    let ends = |c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E' | '+' | '-'));
    text.find(ends).unwrap_or(text.len())
}

/// A value, not a number if it is missing.
struct Value(f64);

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ValueVisitor)
    }
}

struct ValueVisitor;

impl Visitor<'_> for ValueVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or `null`")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(Value(value))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(Value(value as f64))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(Value(value as f64))
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value(f64::NAN))
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Value, E> {
        let word = text.strip_prefix(['-', '+']).unwrap_or(text);
        if NOT_FINITE.iter().any(|known| known.eq_ignore_ascii_case(word)) {
            return Ok(Value(f64::NAN));
        }
        Err(E::invalid_value(Unexpected::Str(text), &self))
    }
}

fn values<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    Ok(Vec::<Value>::deserialize(deserializer)?.into_iter().map(|value| value.0).collect())
}

fn pairs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<[f64; 2]>, D::Error> {
    let pairs = Vec::<[Value; 2]>::deserialize(deserializer)?;
    Ok(pairs.into_iter().map(|pair| pair.map(|value| value.0)).collect())
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
        let quoted = words[1..].iter().map(|word| format!("\"{word}\""));
        let digits = format!("1{}", "0".repeat(400));
        let overflowing = ["1e999", "-1e999", "1.5E+400", "-1.79769313486231581e308", &digits];
        let overflowing = overflowing.map(str::to_owned);
        for word in words.map(str::to_owned).into_iter().chain(quoted).chain(overflowing) {
            let values = format!("{word}, 0.5, 1e-999, 1.7976931348623157e308, 3, -3");
            let read: Sample = decode(text("nan", &values).as_bytes()).unwrap();
            assert_eq!(read.module.as_str(), "nan");
            assert!(read.elongations_m[0].is_nan(), "{word}");
            assert_eq!(read.elongations_m[1..], [0.5, 0.0, f64::MAX, 3.0, -3.0], "{word}");
        }
        for other in ["NaN1", "infinit", "-", "1.#QNAN", "1 NaN", "NaN, 0.5]", "1e999 1", "1-NaN"] {
            let error = decode::<Sample>(text("m", other).as_bytes()).unwrap_err();
            assert!(matches!(error, DecodeError::Malformed(_)), "{other}: {error}");
        }
        for other in [r#""""#, r#""1.5""#, r#""--NaN""#, r#""NaN 1""#, "true", "[]", "{}"] {
            let error = decode::<Sample>(text("m", other).as_bytes()).unwrap_err();
            assert!(error.to_string().contains("expected a number or `null`"), "{other}: {error}");
        }
        assert!(Sample::corrected(r#"{"a\"NaN 1e999": "Infinity"}"#).is_none());
    }

    #[test]
    fn every_array_of_a_sample_may_lack_values() {
        let all = r#"{"v": 1, "module": "m", "run": 1, "step": 2, "time_unix_ns": 3, "demands_n": ["NaN", 1e999], "pressures_pa": [["inf", -1e999], [1e5, NaN]], "elongations_m": ["-Infinity"], "readings": [1e999]}"#;
        let read: Sample = decode(all.as_bytes()).unwrap();
        let missing =
            [&read.demands_n[..], &read.pressures_pa[0], &read.elongations_m, &read.readings];
        assert!(missing.into_iter().flatten().all(|value| value.is_nan()), "{read:?}");
        assert!(read.pressures_pa[1][0] == 1e5 && read.pressures_pa[1][1].is_nan());
        let step = all.replace("\"step\": 2", "\"step\": 1e999");
        assert!(decode::<Sample>(step.as_bytes()).is_err());
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
