//! What can go wrong with a component (sections 3.2 and 3.3 of the paper).
//!
//! The vocabulary is shared: the plant acts on it, messages and schedules carry it. Of a fault itself a diagnoser sees
//! residuals only; kinds are what it may identify.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::component::ComponentKind;

/// A fault with its parameters. Serialised with its kind in the field `kind`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
#[derive(schemars::JsonSchema)]
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
    /// The valve's spool sticks. It stays where it is until the flow that is commanded differs from its own by more
    /// than the band, and then jumps to the command.
    Stiction {
        /// Flow by which a command may differ before the spool moves [m³/s].
        band_m3_per_s: f64,
    },
    /// The gage reads a constant amount too much.
    Bias {
        /// Offset of the elongation [m].
        offset_m: f64,
    },
    /// The gage's offset grows steadily from 0; the first increment is in the first faulty sample.
    Drift {
        /// Drift of the elongation [m/s].
        drift_m_per_s: f64,
    },
    /// The gage's offset wanders: each step adds a normal increment.
    RandomWalk {
        /// Mean drift of the elongation [m/s].
        drift_m_per_s: f64,
        /// Standard deviation of the increment per step [m].
        increment_m: f64,
    },
    /// The gage reads a multiple of the elongation.
    Gain {
        /// The multiple of what it read when it was healthy, noise apart: 1 is healthy.
        gain: f64,
    },
    /// The gage reads zero, noise apart.
    ZeroOutput {},
    /// The gage repeats the last reading that it gave, noise included; its first one if it gave none before.
    Stuck {},
    /// The gage has a bad contact, which opens and closes by chance. It is open in the first faulty sample.
    Intermittent {
        /// Offset of the elongation while the contact is open [m].
        offset_m: f64,
        /// Mean time for which the contact is closed; each time is exponentially distributed [s].
        closed_s: f64,
        /// Mean time for which the contact is open; each time is exponentially distributed [s].
        open_s: f64,
    },
    /// The gage gives no reading at all: its wire is broken.
    NoSignal {},
}

/// A fault without its parameters.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// A leak between the chambers of a cylinder.
    InternalLeakage,
    /// A leak of chamber A of a cylinder to the outside.
    ExternalLeakageA,
    /// A leak of chamber B of a cylinder to the outside.
    ExternalLeakageB,
    /// The inlet valve of chamber A of a cylinder is fully open.
    HardOver,
    /// A cylinder's valve sticks.
    Stiction,
    /// A gage reads a constant too much.
    Bias,
    /// A gage reads too much, more and more at a constant rate.
    Drift,
    /// A gage's error is a random walk.
    RandomWalk,
    /// A gage reads a multiple.
    Gain,
    /// A gage reads zero, noise apart.
    ZeroOutput,
    /// A gage repeats a reading.
    Stuck,
    /// A gage has a bad contact.
    Intermittent,
    /// A gage gives no reading.
    NoSignal,
}

impl FaultKind {
    /// Every kind, actuators first.
    pub const ALL: [FaultKind; 13] = [
        FaultKind::InternalLeakage,
        FaultKind::ExternalLeakageA,
        FaultKind::ExternalLeakageB,
        FaultKind::HardOver,
        FaultKind::Stiction,
        FaultKind::Bias,
        FaultKind::Drift,
        FaultKind::RandomWalk,
        FaultKind::Gain,
        FaultKind::ZeroOutput,
        FaultKind::Stuck,
        FaultKind::Intermittent,
        FaultKind::NoSignal,
    ];

    /// The kinds of the paper, which change a residual; campaigns draw from them. Their order is part of every draw.
    pub const OF_RESIDUALS: &[FaultKind] = &[
        FaultKind::InternalLeakage,
        FaultKind::ExternalLeakageA,
        FaultKind::ExternalLeakageB,
        FaultKind::HardOver,
        FaultKind::Bias,
        FaultKind::RandomWalk,
        FaultKind::ZeroOutput,
    ];

    /// What its size is measured in where it is identified; `None` where it has none.
    #[must_use]
    pub fn size_unit(self) -> Option<&'static str> {
        match self {
            FaultKind::Bias | FaultKind::Intermittent => Some("m"),
            FaultKind::Drift => Some("m/s"),
            FaultKind::RandomWalk => Some("m per step"),
            FaultKind::Gain => Some("1"),
            FaultKind::InternalLeakage
            | FaultKind::ExternalLeakageA
            | FaultKind::ExternalLeakageB => Some("m²"),
            FaultKind::HardOver
            | FaultKind::Stiction
            | FaultKind::ZeroOutput
            | FaultKind::Stuck
            | FaultKind::NoSignal => None,
        }
    }

    /// The kind of component that can have this fault.
    #[must_use]
    pub fn component_kind(self) -> ComponentKind {
        match self {
            FaultKind::InternalLeakage
            | FaultKind::ExternalLeakageA
            | FaultKind::ExternalLeakageB
            | FaultKind::HardOver
            | FaultKind::Stiction => ComponentKind::Actuator,
            FaultKind::Bias
            | FaultKind::Drift
            | FaultKind::RandomWalk
            | FaultKind::Gain
            | FaultKind::ZeroOutput
            | FaultKind::Stuck
            | FaultKind::Intermittent
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
            FaultKind::Stiction => "stiction",
            FaultKind::Bias => "bias",
            FaultKind::Drift => "drift",
            FaultKind::RandomWalk => "random_walk",
            FaultKind::Gain => "gain",
            FaultKind::ZeroOutput => "zero_output",
            FaultKind::Stuck => "stuck",
            FaultKind::Intermittent => "intermittent",
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
            FaultKind::Stiction => "stiction of the valve",
            FaultKind::Bias => "bias",
            FaultKind::Drift => "drift",
            FaultKind::RandomWalk => "random walk",
            FaultKind::Gain => "gain",
            FaultKind::ZeroOutput => "zero output",
            FaultKind::Stuck => "stuck reading",
            FaultKind::Intermittent => "intermittent contact",
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
            Fault::Stiction { band_m3_per_s } => {
                let band = cubic_centimetres(band_m3_per_s);
                write!(f, "the valve's spool sticks until its flow is off by {band:.2} cm³/s")
            }
            Fault::Bias { offset_m } => write!(f, "bias of {:+.1} µm", micrometres(offset_m)),
            Fault::Drift { drift_m_per_s }
            | Fault::RandomWalk { drift_m_per_s, increment_m: 0.0 } => {
                write!(f, "steady drift of {:+.1} µm/s", micrometres(drift_m_per_s))
            }
            Fault::RandomWalk { drift_m_per_s, increment_m } => write!(
                f,
                "random walk, {:+.1} µm/s on average with steps of {:.2} µm",
                micrometres(drift_m_per_s),
                micrometres(increment_m)
            ),
            Fault::Gain { gain } => write!(f, "gain of {gain:.3}, 1 would be right"),
            Fault::ZeroOutput {} => f.write_str("zero output, the gage reads nothing but noise"),
            Fault::Stuck {} => f.write_str("stuck, the gage repeats its last reading"),
            Fault::Intermittent { offset_m, closed_s, open_s } => write!(
                f,
                "bad contact, off by {:+.1} µm for {:.1} ms after {:.1} ms without, on average",
                micrometres(offset_m),
                milliseconds(open_s),
                milliseconds(closed_s)
            ),
            Fault::NoSignal {} => f.write_str("no signal, the gage's wire is broken"),
        }
    }
}

fn micrometres(metres: f64) -> f64 {
    metres * 1e6
}

fn cubic_centimetres(cubic_metres: f64) -> f64 {
    cubic_metres * 1e6
}

fn milliseconds(seconds: f64) -> f64 {
    seconds * 1e3
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
            Fault::Stiction { .. } => FaultKind::Stiction,
            Fault::Bias { .. } => FaultKind::Bias,
            Fault::Drift { .. } => FaultKind::Drift,
            Fault::RandomWalk { .. } => FaultKind::RandomWalk,
            Fault::Gain { .. } => FaultKind::Gain,
            Fault::ZeroOutput {} => FaultKind::ZeroOutput,
            Fault::Stuck {} => FaultKind::Stuck,
            Fault::Intermittent { .. } => FaultKind::Intermittent,
            Fault::NoSignal {} => FaultKind::NoSignal,
        }
    }

    /// Its parameters by their names in files and messages, in the order in which people read them.
    #[must_use]
    pub fn parameters(&self) -> Vec<(&'static str, f64)> {
        match *self {
            Fault::InternalLeakage { area_m2 }
            | Fault::ExternalLeakageA { area_m2 }
            | Fault::ExternalLeakageB { area_m2 } => vec![("area_m2", area_m2)],
            Fault::Stiction { band_m3_per_s } => vec![("band_m3_per_s", band_m3_per_s)],
            Fault::Bias { offset_m } => vec![("offset_m", offset_m)],
            Fault::Drift { drift_m_per_s } => vec![("drift_m_per_s", drift_m_per_s)],
            Fault::RandomWalk { drift_m_per_s, increment_m } => {
                vec![("drift_m_per_s", drift_m_per_s), ("increment_m", increment_m)]
            }
            Fault::Gain { gain } => vec![("gain", gain)],
            Fault::Intermittent { offset_m, closed_s, open_s } => {
                vec![("offset_m", offset_m), ("closed_s", closed_s), ("open_s", open_s)]
            }
            Fault::HardOver {} | Fault::ZeroOutput {} | Fault::Stuck {} | Fault::NoSignal {} => {
                Vec::new()
            }
        }
    }

    /// Checks that every parameter is finite and in range.
    ///
    /// # Errors
    /// The first parameter that is not, with what would be right.
    pub fn check(&self) -> Result<(), FaultError> {
        for (parameter, value) in self.parameters() {
            let (right, expected) = range(parameter, value);
            if !right {
                return Err(FaultError { kind: self.kind(), parameter, value, expected });
            }
        }
        Ok(())
    }
}

/// Whether a parameter's value is in its range, and what that is.
fn range(parameter: &str, value: f64) -> (bool, &'static str) {
    match parameter {
        "area_m2" => (value > 0.0 && value < 1e-4, "an area above 0 and below 1e-4 m²"),
        "band_m3_per_s" => (value > 0.0 && value <= 1e-3, "a flow above 0 and at most 1e-3 m³/s"),
        "offset_m" => (value.abs() < 1.0, "an offset within ±1 m"),
        "drift_m_per_s" => (value.abs() < 1.0, "a drift within ±1 m/s"),
        "increment_m" => ((0.0..1.0).contains(&value), "an increment from 0 to 1 m"),
        "gain" => (
            value > 0.0 && value <= 10.0,
            "a gain above 0 and at most 10, where 1 is healthy; for 0 there is `zero_output`",
        ),
        "closed_s" | "open_s" => {
            ((1e-3..=3600.0).contains(&value), "a mean time from 0.001 s to 3600 s")
        }
        // Without a range none is right, so that a new parameter cannot go without one.
        _ => (false, "a parameter that has a range"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_belongs_to_one_kind_of_component() {
        let actuators =
            FaultKind::ALL.iter().filter(|k| k.component_kind() == ComponentKind::Actuator).count();
        assert_eq!(actuators, 5);
    }

    #[test]
    fn people_read_sizes_in_small_units() {
        let walk = Fault::RandomWalk { drift_m_per_s: 2e-4, increment_m: 2e-5 };
        let leak = Fault::ExternalLeakageA { area_m2: 3e-7 };
        let drift = Fault::RandomWalk { drift_m_per_s: 9e-5, increment_m: 0.0 };
        for (fault, expected) in [
            (Fault::Bias { offset_m: -6e-4 }, "bias of -600.0 µm"),
            (walk, "random walk, +200.0 µm/s on average with steps of 20.00 µm"),
            (drift, "steady drift of +90.0 µm/s"),
            (Fault::Drift { drift_m_per_s: -9e-5 }, "steady drift of -90.0 µm/s"),
            (Fault::Gain { gain: 0.95 }, "gain of 0.950, 1 would be right"),
            (
                Fault::Intermittent { offset_m: 5e-5, closed_s: 0.5, open_s: 0.02 },
                "bad contact, off by +50.0 µm for 20.0 ms after 500.0 ms without, on average",
            ),
            (leak, "chamber A leaks to the outside, coefficient 3.00e-7 m²"),
            (
                Fault::Stiction { band_m3_per_s: 1e-5 },
                "the valve's spool sticks until its flow is off by 10.00 cm³/s",
            ),
        ] {
            assert_eq!(fault.to_string(), expected);
        }
    }

    #[test]
    fn parameters_out_of_range_are_named() {
        let error = Fault::Bias { offset_m: f64::NAN }.check().unwrap_err().to_string();
        assert!(error.contains("offset_m"), "{error}");
        assert!(Fault::InternalLeakage { area_m2: -1.0 }.check().is_err());
        assert!(Fault::HardOver {}.check().is_ok());
        let contact =
            |offset_m, closed_s, open_s| Fault::Intermittent { offset_m, closed_s, open_s };
        for (fault, parameter, right) in [
            (Fault::Drift { drift_m_per_s: -1.0 }, "drift_m_per_s", "±1 m/s"),
            (Fault::Gain { gain: 0.0 }, "gain", "`zero_output`"),
            (Fault::Gain { gain: 10.5 }, "gain", "at most 10"),
            (Fault::Gain { gain: f64::NAN }, "gain", "above 0"),
            (contact(1.0, 0.5, 0.02), "offset_m", "±1 m"),
            (contact(1e-4, 1e-4, 0.02), "closed_s", "from 0.001 s to 3600 s"),
            (contact(1e-4, 0.5, f64::INFINITY), "open_s", "from 0.001 s to 3600 s"),
            (Fault::Stiction { band_m3_per_s: 0.0 }, "band_m3_per_s", "above 0"),
            (Fault::Stiction { band_m3_per_s: 2e-3 }, "band_m3_per_s", "1e-3 m³/s"),
        ] {
            let error = fault.check().unwrap_err().to_string();
            let named = error.starts_with(&format!("`{parameter}` of fault `{}`", fault.kind()));
            assert!(named && error.contains(right), "{error}");
        }
        for fault in [
            Fault::Drift { drift_m_per_s: -0.9 },
            Fault::Gain { gain: 1.0 },
            Fault::Gain { gain: 10.0 },
            contact(-1e-4, 1e-3, 3600.0),
            Fault::Stiction { band_m3_per_s: 1e-3 },
        ] {
            assert_eq!(fault.check(), Ok(()), "{fault}");
        }
    }

    #[test]
    fn campaigns_draw_the_kinds_of_the_paper_in_their_order() {
        let names: Vec<&str> = FaultKind::OF_RESIDUALS.iter().map(|kind| kind.as_str()).collect();
        let expected = [
            "internal_leakage",
            "external_leakage_a",
            "external_leakage_b",
            "hard_over",
            "bias",
            "random_walk",
            "zero_output",
        ];
        assert_eq!(names, expected);
    }
}
