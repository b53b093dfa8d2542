//! What can go wrong with a component (sections 3.2 and 3.3 of the paper).
//!
//! The vocabulary is shared: the plant acts on it, messages and schedules carry it. A diagnoser never
//! sees it: it knows residuals only.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::component::ComponentKind;

/// A fault with its parameters. Serialised with its kind in the field `kind`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Fault {
    /// Oil leaks from chamber A into chamber B (eq. 10).
    InternalLeakage {
        /// Leak coefficient [m²].
        area_m2: f64,
    },
    /// Chamber A leaks to the environment (eq. 11).
    ExternalLeakageA {
        /// Leak coefficient [m²].
        area_m2: f64,
    },
    /// Chamber B leaks to the environment (eq. 11).
    ExternalLeakageB {
        /// Leak coefficient [m²].
        area_m2: f64,
    },
    /// The inlet valve of chamber A is fully open, its outlet shut.
    HardOver {},
    /// The gage reads a constant amount too much.
    Bias {
        /// Offset of the elongation [m].
        offset_m: f64,
    },
    /// The gage's offset wanders: each step adds a normal increment.
    RandomWalk {
        /// Mean drift of the elongation [m/s].
        drift_m_per_s: f64,
        /// Standard deviation of the increment per step [m].
        increment_m: f64,
    },
    /// The gage reads zero, noise apart.
    ZeroOutput {},
    /// The gage gives no reading at all: its wire is broken.
    NoSignal {},
}

/// A fault without its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// See [`Fault::InternalLeakage`].
    InternalLeakage,
    /// See [`Fault::ExternalLeakageA`].
    ExternalLeakageA,
    /// See [`Fault::ExternalLeakageB`].
    ExternalLeakageB,
    /// See [`Fault::HardOver`].
    HardOver,
    /// See [`Fault::Bias`].
    Bias,
    /// See [`Fault::RandomWalk`].
    RandomWalk,
    /// See [`Fault::ZeroOutput`].
    ZeroOutput,
    /// See [`Fault::NoSignal`].
    NoSignal,
}

impl FaultKind {
    /// Every kind, actuators first.
    pub const ALL: [FaultKind; 8] = [
        FaultKind::InternalLeakage,
        FaultKind::ExternalLeakageA,
        FaultKind::ExternalLeakageB,
        FaultKind::HardOver,
        FaultKind::Bias,
        FaultKind::RandomWalk,
        FaultKind::ZeroOutput,
        FaultKind::NoSignal,
    ];

    /// The kinds of the paper, which change a residual. A missing signal, the last, is no question of detection.
    pub const OF_RESIDUALS: &[FaultKind] = match Self::ALL.split_last() {
        Some((_no_signal, kinds)) => kinds,
        None => &[],
    };

    /// The kind of component that can have this fault.
    #[must_use]
    pub fn component_kind(self) -> ComponentKind {
        match self {
            FaultKind::InternalLeakage
            | FaultKind::ExternalLeakageA
            | FaultKind::ExternalLeakageB
            | FaultKind::HardOver => ComponentKind::Actuator,
            FaultKind::Bias
            | FaultKind::RandomWalk
            | FaultKind::ZeroOutput
            | FaultKind::NoSignal => ComponentKind::Sensor,
        }
    }

    /// The name used in files and messages, e.g. `random_walk`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            FaultKind::InternalLeakage => "internal_leakage",
            FaultKind::ExternalLeakageA => "external_leakage_a",
            FaultKind::ExternalLeakageB => "external_leakage_b",
            FaultKind::HardOver => "hard_over",
            FaultKind::Bias => "bias",
            FaultKind::RandomWalk => "random_walk",
            FaultKind::ZeroOutput => "zero_output",
            FaultKind::NoSignal => "no_signal",
        }
    }

    /// What it is called in a sentence, e.g. `external leakage of chamber A`.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            FaultKind::InternalLeakage => "internal leakage",
            FaultKind::ExternalLeakageA => "external leakage of chamber A",
            FaultKind::ExternalLeakageB => "external leakage of chamber B",
            FaultKind::HardOver => "hard-over",
            FaultKind::Bias => "bias",
            FaultKind::RandomWalk => "random walk",
            FaultKind::ZeroOutput => "zero output",
            FaultKind::NoSignal => "no signal",
        }
    }
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// With its size, for people: `bias of -600.0 µm`.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let micrometres = |metres: f64| metres * 1e6;
        match *self {
            Fault::InternalLeakage { area_m2 } => {
                write!(f, "oil leaks from chamber A into chamber B, coefficient {area_m2:.2e} m²")
            }
            Fault::ExternalLeakageA { area_m2 } => {
                write!(f, "chamber A leaks to the outside, coefficient {area_m2:.2e} m²")
            }
            Fault::ExternalLeakageB { area_m2 } => {
                write!(f, "chamber B leaks to the outside, coefficient {area_m2:.2e} m²")
            }
            Fault::HardOver {} => {
                f.write_str("hard-over, the inlet valve of chamber A is fully open")
            }
            Fault::Bias { offset_m } => write!(f, "bias of {:+.1} µm", micrometres(offset_m)),
            Fault::RandomWalk { drift_m_per_s, increment_m: 0.0 } => {
                write!(f, "steady drift of {:+.1} µm/s", micrometres(drift_m_per_s))
            }
            Fault::RandomWalk { drift_m_per_s, increment_m } => write!(
                f,
                "random walk, {:+.1} µm/s on average with steps of {:.2} µm",
                micrometres(drift_m_per_s),
                micrometres(increment_m)
            ),
            Fault::ZeroOutput {} => f.write_str("zero output, the gage reads nothing but noise"),
            Fault::NoSignal {} => f.write_str("no signal, the gage's wire is broken"),
        }
    }
}

/// A fault parameter outside its range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{parameter}` of fault `{kind}` is {value}; use {expected}")]
pub struct FaultError {
    kind: FaultKind,
    parameter: &'static str,
    value: f64,
    expected: &'static str,
}

impl Fault {
    /// The kind without parameters.
    #[must_use]
    pub fn kind(&self) -> FaultKind {
        match self {
            Fault::InternalLeakage { .. } => FaultKind::InternalLeakage,
            Fault::ExternalLeakageA { .. } => FaultKind::ExternalLeakageA,
            Fault::ExternalLeakageB { .. } => FaultKind::ExternalLeakageB,
            Fault::HardOver {} => FaultKind::HardOver,
            Fault::Bias { .. } => FaultKind::Bias,
            Fault::RandomWalk { .. } => FaultKind::RandomWalk,
            Fault::ZeroOutput {} => FaultKind::ZeroOutput,
            Fault::NoSignal {} => FaultKind::NoSignal,
        }
    }

    /// Checks that every parameter is finite and in range.
    ///
    /// # Errors
    /// The first parameter that is not, with what would be right.
    pub fn check(&self) -> Result<(), FaultError> {
        let kind = self.kind();
        let require = |ok: bool, parameter, value, expected| {
            if ok { Ok(()) } else { Err(FaultError { kind, parameter, value, expected }) }
        };
        match *self {
            Fault::InternalLeakage { area_m2 }
            | Fault::ExternalLeakageA { area_m2 }
            | Fault::ExternalLeakageB { area_m2 } => require(
                area_m2 > 0.0 && area_m2 < 1e-4,
                "area_m2",
                area_m2,
                "an area above 0 and below 1e-4 m²",
            ),
            Fault::Bias { offset_m } => {
                require(offset_m.abs() < 1.0, "offset_m", offset_m, "an offset within ±1 m")
            }
            Fault::RandomWalk { drift_m_per_s, increment_m } => {
                require(
                    drift_m_per_s.abs() < 1.0,
                    "drift_m_per_s",
                    drift_m_per_s,
                    "a drift within ±1 m/s",
                )?;
                require(
                    (0.0..1.0).contains(&increment_m),
                    "increment_m",
                    increment_m,
                    "an increment from 0 to 1 m",
                )
            }
            Fault::HardOver {} | Fault::ZeroOutput {} | Fault::NoSignal {} => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_belongs_to_one_kind_of_component() {
        let actuators =
            FaultKind::ALL.iter().filter(|k| k.component_kind() == ComponentKind::Actuator).count();
        assert_eq!(actuators, 4);
    }

    #[test]
    fn people_read_sizes_in_small_units() {
        let walk = Fault::RandomWalk { drift_m_per_s: 2e-4, increment_m: 2e-5 };
        let leak = Fault::ExternalLeakageA { area_m2: 3e-7 };
        let drift = Fault::RandomWalk { drift_m_per_s: 9e-5, increment_m: 0.0 };
        let read =
            [Fault::Bias { offset_m: -6e-4 }, walk, drift, leak].map(|fault| fault.to_string());
        let expected = [
            "bias of -600.0 µm",
            "random walk, +200.0 µm/s on average with steps of 20.00 µm",
            "steady drift of +90.0 µm/s",
            "chamber A leaks to the outside, coefficient 3.00e-7 m²",
        ];
        assert_eq!(read, expected);
    }

    #[test]
    fn parameters_out_of_range_are_named() {
        let error = Fault::Bias { offset_m: f64::NAN }.check().unwrap_err().to_string();
        assert!(error.contains("offset_m"), "{error}");
        assert!(Fault::InternalLeakage { area_m2: -1.0 }.check().is_err());
        assert!(Fault::HardOver {}.check().is_ok());
    }
}
