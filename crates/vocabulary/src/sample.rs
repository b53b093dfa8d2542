//! What a module measures at one step, or at several. The data acquisition publishes this, simulated or real.

use std::fmt;

use crate::{ModuleName, RunId, Step};
use schemars::JsonSchema;
use serde::de::{Unexpected, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::encoding::{DecodeError, Encoding, Message, decode_as};

/// A module's measurements at one step, actuators and gages in the order of its description; or at consecutive steps, then
/// all of them in `block`.
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
    /// The sampling instant, counted from 0 within the run; of a block, the first one.
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
    /// In place of the arrays above, the values at this and the following steps, one entry a step: at most 1000. Fewer messages
    /// take less processor time, and the earlier steps of a block wait for its last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = MAX_BLOCK_STEPS))]
    pub block: Vec<StepValues>,
}

/// Most steps of a block.
pub const MAX_BLOCK_STEPS: usize = 1000;

/// The values of one step of a block, each as in a sample of one step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepValues {
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
    /// In place of the others, the reading of each channel of a learned module.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "values")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub readings: Vec<f64>,
}

impl Sample {
    /// The samples of one step each that bytes stand for.
    ///
    /// # Errors
    /// They are no sample, or a block that cannot be.
    pub fn read(
        bytes: &[u8],
        encoding: Encoding,
    ) -> Result<impl Iterator<Item = Sample>, DecodeError> {
        decode_as::<Self>(bytes, encoding)?.into_steps()
    }

    /// The samples of one step each that it stands for: itself, or those of its block.
    ///
    /// # Errors
    /// A block beside values, too long, or with steps that no number counts.
    pub fn into_steps(mut self) -> Result<impl Iterator<Item = Sample>, DecodeError> {
        let mut block = std::mem::take(&mut self.block);
        let own = StepValues {
            demands_n: std::mem::take(&mut self.demands_n),
            pressures_pa: std::mem::take(&mut self.pressures_pa),
            elongations_m: std::mem::take(&mut self.elongations_m),
            readings: std::mem::take(&mut self.readings),
        };
        let problem = if block.is_empty() {
            block.push(own);
            None
        } else if own != StepValues::default() {
            Some("a block beside values of its own; use one of them".to_owned())
        } else if block.len() > MAX_BLOCK_STEPS {
            Some(format!("a block of {} steps; use at most {MAX_BLOCK_STEPS}", block.len()))
        } else if self.step.0.checked_add(block.len() as u64).is_none() {
            Some(format!("a block from step {}; steps have at most 64 bits", self.step))
        } else {
            None
        };
        if let Some(reason) = problem {
            return Err(DecodeError::WrongMessage { what: Self::WHAT, reason });
        }
        let Sample { module, run, step: first, time_unix_ns, .. } = self;
        Ok((0..).zip(block).map(move |(place, values)| {
            let StepValues { demands_n, pressures_pa, elongations_m, readings } = values;
            let (module, step, block) = (module.clone(), first.plus(place), Vec::new());
            Sample {
                module,
                run,
                step,
                time_unix_ns,
                demands_n,
                pressures_pa,
                elongations_m,
                readings,
                block,
            }
        }))
    }
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
        Ok(Value(if value.is_finite() { value } else { f64::NAN }))
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
    use crate::{decode, encode, encode_as};

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
            block: Vec::new(),
        }
    }

    /// The samples of five steps, one value of them missing; and the same as a block.
    fn five() -> (Vec<Sample>, Sample) {
        let of_step = |k: u64| {
            let mut one = Sample { step: Step(40 + k), ..sample() };
            one.elongations_m = vec![k as f64 / 7.0, if k == 3 { f64::NAN } else { -0.0 }];
            one
        };
        let singles: Vec<Sample> = (0..5).map(of_step).collect();
        let values = singles.iter().map(|one| StepValues {
            demands_n: one.demands_n.clone(),
            pressures_pa: one.pressures_pa.clone(),
            elongations_m: one.elongations_m.clone(),
            readings: Vec::new(),
        });
        let (demands_n, pressures_pa, elongations_m) = Default::default();
        let block = Sample {
            step: Step(40),
            demands_n,
            pressures_pa,
            elongations_m,
            block: values.collect(),
            ..sample()
        };
        (singles, block)
    }

    #[test]
    fn a_block_stands_for_its_steps_in_either_encoding() {
        let (singles, block) = five();
        let text = |samples: &mut dyn Iterator<Item = Sample>| -> Vec<String> {
            samples.map(|one| String::from_utf8(encode(&one).unwrap()).unwrap()).collect()
        };
        for encoding in [Encoding::Json, Encoding::Cbor] {
            let bytes = encode_as(&block, encoding).unwrap();
            let back: Sample = decode_as(&bytes, encoding).unwrap();
            assert_eq!(text(&mut back.into_steps().unwrap()), text(&mut singles.iter().cloned()));
            for one in &singles {
                let back: Sample = decode_as(&encode_as(one, encoding).unwrap(), encoding).unwrap();
                assert_eq!(
                    text(&mut back.into_steps().unwrap()),
                    text(&mut [one.clone()].into_iter())
                );
            }
        }
    }

    #[test]
    fn a_block_that_cannot_be_is_refused_with_what_would_be_right() {
        let (_, block) = five();
        let beside = Sample { demands_n: vec![1.0], ..block.clone() };
        let long =
            Sample { block: vec![StepValues::default(); MAX_BLOCK_STEPS + 1], ..block.clone() };
        let endless = Sample { step: Step(u64::MAX - 2), ..block };
        for (sample, said) in
            [(beside, "use one of them"), (long, "at most 1000"), (endless, "64 bits")]
        {
            let Err(error) = sample.into_steps() else { panic!("{said}") };
            assert!(
                matches!(error, DecodeError::WrongMessage { .. })
                    && error.to_string().contains(said),
                "{error}"
            );
        }
    }

    #[test]
    fn cbor_that_is_no_sample_is_refused_by_its_kind() {
        let good = encode_as(&sample(), Encoding::Cbor).unwrap();
        let read = |bytes: &[u8]| decode_as::<Sample>(bytes, Encoding::Cbor).unwrap_err();
        for length in 0..good.len() {
            assert!(matches!(read(&good[..length]), DecodeError::Malformed(_)), "{length}");
        }
        let longer: Vec<u8> = good.iter().copied().chain([0]).collect();
        assert!(matches!(read(&longer), DecodeError::Malformed(_)));
        assert!(matches!(
            read(b"{\"v\":1}"),
            DecodeError::Malformed(_) | DecodeError::WrongMessage { .. }
        ));
        let map = |pairs: &serde_json::Value| {
            let mut bytes = Vec::new();
            ciborium::into_writer(pairs, &mut bytes).unwrap();
            bytes
        };
        let with = |key: &str, value: serde_json::Value| {
            let mut fields = serde_json::to_value(sample()).unwrap();
            fields["v"] = 1.into();
            fields[key] = value;
            map(&fields)
        };
        assert_eq!(read(&map(&serde_json::json!({"step": 1}))), DecodeError::NoVersion);
        assert_eq!(read(&with("v", 2.into())), DecodeError::UnknownVersion("2".to_owned()));
        for (key, value) in [
            ("step", (-1).into()),
            ("module", "../m".into()),
            ("pressures_pa", vec![vec![1.0]].into()),
        ] {
            let error = read(&with(key, value));
            assert!(matches!(error, DecodeError::WrongMessage { .. }), "{key}: {error}");
        }
        // An array that claims to be longer than memory, and arrays within arrays.
        for bytes in
            [vec![0x9b, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff], vec![0x81; 100_000]]
        {
            let error = read(&bytes);
            assert!(error.to_string().len() < 300, "{error}");
        }
        let too_long = vec![0; crate::MAX_MESSAGE_BYTES + 1];
        assert!(matches!(read(&too_long), DecodeError::TooLong { .. }));
    }

    #[test]
    fn what_is_not_finite_in_cbor_is_missing() {
        let mut odd = sample();
        odd.elongations_m = vec![f64::INFINITY, f64::NEG_INFINITY, f64::NAN, f64::MAX];
        let back: Sample =
            decode_as(&encode_as(&odd, Encoding::Cbor).unwrap(), Encoding::Cbor).unwrap();
        assert!(back.elongations_m[..3].iter().all(|value| value.is_nan()));
        assert_eq!(back.elongations_m[3], f64::MAX);
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
