//! What can go wrong with a component (sections 3.2 and 3.3 of the paper).
//!
//! The vocabulary is shared: the plant acts on it, messages and schedules carry it. Of a fault itself a diagnoser sees
//! residuals only; kinds are what it may identify.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::component::ComponentKind;

/// Makes [`Fault`] and [`FaultKind`] of one entry a kind: what it is, which component can have it, its name in files
/// and messages, what it is called in a sentence, which parameter is its size and in what unit, and its parameters.
macro_rules! faults {
    ($(
        $(#[doc = $help:tt])+
        $kind:ident: $component:ident, $name:tt, $words:tt $(, size $size:ident in $unit:tt)? {
            $( $(#[doc = $of:tt])+ $parameter:ident, )*
        }
    )+) => {
        /// A fault with its parameters. Serialised with its kind in the field `kind`.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "kind", deny_unknown_fields)]
        pub enum Fault {
            $(
                $(#[doc = $help])+
                #[serde(rename = $name)]
                $kind { $( $(#[doc = $of])+ $parameter: f64, )* },
            )+
        }

        /// A fault without its parameters.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[derive(Serialize, Deserialize, JsonSchema)]
        pub enum FaultKind {
            $(
                $(#[doc = $help])+
                #[serde(rename = $name)]
                $kind,
            )+
        }

        impl Fault {
            /// The fault of a kind, with the number of each parameter by its name. [`Fault::check`] judges them.
            #[must_use]
            pub fn new(kind: FaultKind, number: impl Fn(&'static str) -> f64) -> Self {
                match kind {
                    $( FaultKind::$kind => Fault::$kind {
                        $( $parameter: number(stringify!($parameter)), )*
                    }, )+
                }
            }

            /// The kind without parameters.
            #[must_use]
            pub fn kind(&self) -> FaultKind {
                match self {
                    $( Fault::$kind { .. } => FaultKind::$kind, )+
                }
            }

            /// Its parameters by their names in files and messages, in the order in which people read them.
            #[must_use]
            pub fn parameters(&self) -> Vec<(&'static str, f64)> {
                match *self {
                    $( Fault::$kind { $( $parameter ),* } => {
                        vec![$( (stringify!($parameter), $parameter) ),*]
                    } )+
                }
            }
        }

        impl FaultKind {
            /// Every kind, actuators first.
            pub const ALL: [FaultKind; [$( $name ),+].len()] = [$( FaultKind::$kind ),+];

            fn entry(self) -> KindEntry {
                match self {
                    $( FaultKind::$kind => KindEntry {
                        name: $name,
                        words: $words,
                        help: concat!($( $help ),+).trim_ascii(),
                        component: ComponentKind::$component,
                        size: const { &[$( (stringify!($size), $unit) )?] },
                        parameters: const { &[$( FaultParameter {
                            name: stringify!($parameter),
                            help: concat!($( $of ),+).trim_ascii(),
                        } ),*] },
                    }, )+
                }
            }
        }
    };
}

faults! {
    // Eq. 10.
    /// Oil leaks from chamber A into chamber B.
    InternalLeakage: Actuator, "internal_leakage", "internal leakage", size area_m2 in "m²" {
        /// Leak coefficient [m²].
        area_m2,
    }
    // Eq. 11, and so the next.
    /// Chamber A leaks to the environment.
    ExternalLeakageA: Actuator, "external_leakage_a", "external leakage of chamber A",
    size area_m2 in "m²" {
        /// Leak coefficient [m²].
        area_m2,
    }
    /// Chamber B leaks to the environment.
    ExternalLeakageB: Actuator, "external_leakage_b", "external leakage of chamber B",
    size area_m2 in "m²" {
        /// Leak coefficient [m²].
        area_m2,
    }
    /// The inlet valve of chamber A is fully open, its outlet shut.
    HardOver: Actuator, "hard_over", "hard-over" {}
    /// The valve's spool sticks. It stays where it is until the flow that is commanded differs from its own by more
    /// than the band, and then jumps to the command.
    Stiction: Actuator, "stiction", "stiction of the valve", size band_m3_per_s in "m³/s" {
        /// Flow by which a command may differ before the spool moves [m³/s].
        band_m3_per_s,
    }
    /// The gage reads a constant amount too much.
    Bias: Sensor, "bias", "bias", size offset_m in "m" {
        /// Offset of the elongation [m].
        offset_m,
    }
    /// The gage's offset grows steadily from 0. The first increment is in the first faulty sample.
    Drift: Sensor, "drift", "drift", size drift_m_per_s in "m/s" {
        /// Drift of the elongation [m/s].
        drift_m_per_s,
    }
    /// The gage's offset wanders: each step adds a normal increment.
    RandomWalk: Sensor, "random_walk", "random walk", size increment_m in "m per step" {
        /// Mean drift of the elongation [m/s].
        drift_m_per_s,
        /// Standard deviation of the increment per step [m].
        increment_m,
    }
    /// The gage reads a multiple of the elongation.
    Gain: Sensor, "gain", "gain", size gain in "1" {
        /// Multiple of the elongation that the gage reads, noise apart; 1 is healthy.
        gain,
    }
    /// The gage reads zero, noise apart.
    ZeroOutput: Sensor, "zero_output", "zero output" {}
    /// The gage repeats the last reading that it gave, noise included. It repeats its first one if it gave none before.
    Stuck: Sensor, "stuck", "stuck reading" {}
    /// The gage has a bad contact, which opens and closes by chance. It is open in the first faulty sample.
    Intermittent: Sensor, "intermittent", "intermittent contact", size offset_m in "m" {
        /// Offset of the elongation while the contact is open [m].
        offset_m,
        /// Mean time for which the contact is closed; each time is exponentially distributed [s].
        closed_s,
        /// Mean time for which the contact is open; each time is exponentially distributed [s].
        open_s,
    }
    /// The gage gives no reading at all: its wire is broken.
    NoSignal: Sensor, "no_signal", "no signal" {}
}

/// What there is to know of a kind.
struct KindEntry {
    name: &'static str,
    words: &'static str,
    help: &'static str,
    component: ComponentKind,
    /// The parameter with its unit, or nothing.
    size: &'static [(&'static str, &'static str)],
    parameters: &'static [FaultParameter],
}

/// A number that a kind of fault needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultParameter {
    /// Its name in files and messages, e.g. `offset_m`.
    pub name: &'static str,
    /// What it is, with its unit, in a sentence.
    pub help: &'static str,
}

impl FaultKind {
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

    /// The kind of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.as_str() == name)
    }

    /// The name used in files and messages, e.g. `random_walk`.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        self.entry().name
    }

    /// What it is called in a sentence, e.g. `external leakage of chamber A`.
    #[must_use]
    pub fn words(self) -> &'static str {
        self.entry().words
    }

    /// What happens, in sentences.
    #[must_use]
    pub fn help(self) -> &'static str {
        self.entry().help
    }

    /// The kind of component that can have this fault.
    #[must_use]
    pub fn component_kind(self) -> ComponentKind {
        self.entry().component
    }

    /// What it needs.
    #[must_use]
    pub fn parameters(self) -> &'static [FaultParameter] {
        self.entry().parameters
    }

    /// The parameter that is its size; `None` if it has none.
    #[must_use]
    pub fn size_parameter(self) -> Option<&'static str> {
        self.entry().size.first().map(|(parameter, _)| *parameter)
    }

    /// What its size is measured in; `None` if it has none.
    #[must_use]
    pub fn size_unit(self) -> Option<&'static str> {
        self.entry().size.first().map(|(_, unit)| *unit)
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
    /// The fault of a kind with this size; its other parameters are 0.
    #[must_use]
    pub fn of_size(kind: FaultKind, size: f64) -> Self {
        Self::new(kind, |name| if kind.size_parameter() == Some(name) { size } else { 0.0 })
    }

    /// Its size in [`FaultKind::size_unit`]; `None` if it has none.
    #[must_use]
    pub fn size(&self) -> Option<f64> {
        let size = self.kind().size_parameter()?;
        self.parameters().into_iter().find_map(|(name, number)| (name == size).then_some(number))
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
    fn a_kind_s_entry_is_what_its_fault_has() {
        for kind in FaultKind::ALL {
            let fault = Fault::of_size(kind, 0.5);
            assert_eq!((fault.kind(), FaultKind::named(kind.as_str())), (kind, Some(kind)));
            assert_eq!(fault.size(), kind.size_unit().map(|_| 0.5), "{kind}");
            assert_eq!(kind.size_unit().is_some(), !kind.parameters().is_empty(), "{kind}");
            let names: Vec<&str> = fault.parameters().into_iter().map(|(name, _)| name).collect();
            let expected = kind.parameters().iter().map(|parameter| parameter.name);
            assert!(names.iter().copied().eq(expected), "{kind}");
            let document = serde_json::to_value(fault).unwrap();
            assert_eq!(document["kind"], kind.as_str());
            for name in &names {
                assert!(document[name].is_number(), "{kind} {name}");
                assert_ne!(range(name, 0.0).1, range("", 0.0).1, "{name} has no range");
            }
        }
        let actuators =
            FaultKind::ALL.iter().filter(|k| k.component_kind() == ComponentKind::Actuator).count();
        assert_eq!(actuators, 5);
    }

    #[test]
    fn the_manual_has_every_kind_with_its_parameters() {
        let manual = concat!(env!("CARGO_MANIFEST_DIR"), "/../../configs/README.md");
        let manual = std::fs::read_to_string(manual).unwrap();
        let (_, section) = manual.split_once("\n## Faults of the simulated plant\n").unwrap();
        let (section, _) = section.split_once("\n## ").unwrap();
        for kind in FaultKind::ALL {
            let row = section.lines().find(|line| line.contains(&format!("`{kind}`"))).unwrap();
            let cell = row.split('|').nth(2).unwrap();
            let documented: Vec<&str> = cell.split('`').skip(1).step_by(2).collect();
            let parameters = kind.parameters().iter().map(|parameter| parameter.name);
            assert!(documented.iter().copied().eq(parameters), "{kind}: {row}");
        }
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
