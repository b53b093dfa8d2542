//! What a module measures at one step. The data acquisition publishes this, simulated or real.

use crate::{ModuleName, RunId, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::encoding::Message;

/// A module's measurements at one step, actuators and gages in the order of its description.
///
/// A value that is missing is `null`. The others are used; a component whose values are missing for 50 samples in
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
    #[serde(deserialize_with = "values")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub demands_n: Vec<f64>,
    /// Pressures of chambers A and B of each actuator \[Pa\].
    #[serde(deserialize_with = "pairs")]
    #[schemars(with = "Vec<[Option<f64>; 2]>")]
    pub pressures_pa: Vec<[f64; 2]>,
    /// Elongation of each gage's member \[m\].
    #[serde(deserialize_with = "values")]
    #[schemars(with = "Vec<Option<f64>>")]
    pub elongations_m: Vec<f64>,
}

impl Message for Sample {
    const WHAT: &'static str = "sample";
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
