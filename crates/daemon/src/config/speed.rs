//! The speed of the plant.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The speed of simulated time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "SpeedValue", into = "SpeedValue")]
pub enum Speed {
    /// The speed of the slowest diagnoser.
    Max,
    /// A multiple of real time.
    Factor(f64),
}

impl Speed {
    /// Real time.
    pub const REAL: Speed = Speed::Factor(1.0);

    /// The factor, unless the speed is [`Speed::Max`].
    #[must_use]
    pub fn factor(self) -> Option<f64> {
        match self {
            Speed::Max => None,
            Speed::Factor(factor) => Some(factor),
        }
    }
}

/// An invalid speed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("invalid speed `{0}`: expected `max`, `real` or a factor from 0.001 to 1000")]
pub struct SpeedError(String);

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum SpeedValue {
    Number(f64),
    Word(String),
}

impl TryFrom<SpeedValue> for Speed {
    type Error = SpeedError;
    fn try_from(written: SpeedValue) -> Result<Self, SpeedError> {
        match written {
            SpeedValue::Number(factor) => factor.to_string().parse(),
            SpeedValue::Word(word) => word.parse(),
        }
    }
}

impl From<Speed> for SpeedValue {
    fn from(speed: Speed) -> Self {
        match speed {
            Speed::Max => SpeedValue::Word("max".to_owned()),
            Speed::Factor(factor) => SpeedValue::Number(factor),
        }
    }
}

impl FromStr for Speed {
    type Err = SpeedError;
    fn from_str(text: &str) -> Result<Self, SpeedError> {
        match text {
            "max" => Ok(Speed::Max),
            "real" => Ok(Speed::REAL),
            number => match number.parse::<f64>() {
                Ok(factor) if (0.001..=1000.0).contains(&factor) => Ok(Speed::Factor(factor)),
                _ => Err(SpeedError(vocabulary::quotation(number, 40))),
            },
        }
    }
}

impl fmt::Display for Speed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Speed::Max => f.write_str("max"),
            Speed::Factor(factor) => write!(f, "{factor}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_factors_are_speeds_and_nothing_else_is() {
        assert_eq!("max".parse(), Ok(Speed::Max));
        assert_eq!("real".parse(), Ok(Speed::REAL));
        assert_eq!("4".parse(), Ok(Speed::Factor(4.0)));
        for text in ["", "fast", "0", "-1", "NaN", "inf", "1e9"] {
            assert!(text.parse::<Speed>().is_err(), "{text}");
        }
    }
}
