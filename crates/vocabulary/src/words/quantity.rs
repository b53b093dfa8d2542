//! Quantities with their units.

use super::identification::decimals;
use crate::{ComponentKind, Doubt, FaultTransition, Symptom, Verdict};

/// A residual in the unit that suits it: N for an actuator, µm for a gage.
pub fn residual(kind: ComponentKind, value: f64) -> String {
    match kind {
        ComponentKind::Actuator => format!("{value:+.1} N"),
        ComponentKind::Sensor => format!("{:+.2} µm", value * 1e6),
    }
}

/// What was measured at the detection and how far beyond its threshold the test was, each with its name: a residual
/// and its divergence, or what departs from the reference and its score. `None` where neither describes the component.
pub fn at_detection(transition: &FaultTransition) -> Option<[(&'static str, String); 2]> {
    // Of several suspects none was tested alone.
    if matches!(&transition.verdict, Verdict::Unconfirmed { doubt: Doubt::OneOf(_) }) {
        return None;
    }
    let evidence = transition.evidence.as_ref()?;
    let (value, times) = (evidence.residual, evidence.ratio());
    let of_residual = || ("residual", residual(transition.component.component.kind(), value));
    let score = || ("score", format!("{times:.1} × its threshold"));
    match transition.symptom {
        // Without a signal the last computed evidence does not describe the component.
        Symptom::NoSignal => None,
        Symptom::Change => Some([of_residual(), ("divergence", ratio(times))]),
        Symptom::Departure => Some([of_residual(), score()]),
        Symptom::OilContent => Some([("oil content", format!("{:+.2} bar", value / 1e5)), score()]),
        Symptom::Scatter => Some([("noise", format!("{:.2} µm", value * 1e6)), score()]),
        Symptom::Reading => Some([("too large by", in_own_unit(value)), score()]),
    }
}

/// By how much a component departs from its reference. `None` for symptoms that are not judged against a reference.
pub fn departure(
    kind: ComponentKind,
    symptom: Symptom,
    measured: f64,
    expected: f64,
) -> Option<String> {
    let off = measured - expected;
    match symptom {
        Symptom::Change | Symptom::NoSignal => None,
        Symptom::Departure => Some(format!("its mean by {}", residual(kind, off))),
        Symptom::OilContent => Some(format!("its oil content by {:+.2} bar", off / 1e5)),
        Symptom::Scatter => {
            let (measured, expected) = (measured * 1e6, expected * 1e6);
            Some(format!("its noise is {measured:.2} µm instead of {expected:.2} µm"))
        }
        Symptom::Reading => Some(format!("its reading by {}", in_own_unit(off))),
    }
}

/// A value whose unit is not known, to four digits.
pub(super) fn in_own_unit(value: f64) -> String {
    let digits = decimals(value / 1e3);
    format!("{value:+.digits$}")
}

/// A force as it was ordered: in kN from 1 kN on.
pub fn force(newtons: f64) -> String {
    if newtons.abs() < 1e3 { format!("{newtons} N") } else { format!("{} kN", newtons / 1e3) }
}

/// A divergence in multiples of its threshold.
pub fn ratio(ratio: f64) -> String {
    format!("{ratio:.1} × threshold")
}

/// A span of time given in milliseconds.
pub fn span(ms: f64) -> String {
    let seconds = ms / 1e3;
    match ms.abs() {
        ..9.95 => format!("{ms:.1} ms"),
        ..999.5 => format!("{ms:.0} ms"),
        ..120e3 => format!("{seconds:.1} s"),
        ..7200e3 => format!("{:.1} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residuals_have_the_unit_of_their_component() {
        assert_eq!(residual(ComponentKind::Actuator, -1234.56), "-1234.6 N");
        assert_eq!(residual(ComponentKind::Sensor, 6e-4), "+600.00 µm");
    }

    #[test]
    fn a_departure_has_the_unit_of_its_symptom() {
        let (gage, cylinder) = (ComponentKind::Sensor, ComponentKind::Actuator);
        for (kind, symptom, measured, expected, words) in [
            (gage, Symptom::Departure, 84e-6, 1e-6, "its mean by +83.00 µm"),
            (cylinder, Symptom::Departure, -12.0, 1.0, "its mean by -13.0 N"),
            (cylinder, Symptom::OilContent, 93e5, 10e5, "its oil content by +83.00 bar"),
            (gage, Symptom::Scatter, 9e-7, 3e-7, "its noise is 0.90 µm instead of 0.30 µm"),
            (gage, Symptom::Reading, 30.0, 0.0, "its reading by +30.00"),
        ] {
            assert_eq!(departure(kind, symptom, measured, expected).as_deref(), Some(words));
        }
        assert_eq!(departure(gage, Symptom::Change, 1.0, 0.0), None);
    }

    #[test]
    fn what_was_measured_has_the_unit_of_its_symptom() {
        let words = |component: &str, symptom, residual| {
            let component = component.parse().unwrap();
            let untouched = FaultTransition::untouched("t".parse().unwrap(), component, 0);
            let evidence = crate::Evidence {
                step: crate::Step(9),
                residual,
                level: 0.0,
                divergence: Some(45.8),
                threshold: 2.0,
            };
            let verdict = Verdict::example(crate::FaultState::Latched);
            at_detection(&FaultTransition {
                symptom,
                verdict,
                evidence: Some(evidence),
                ..untouched
            })
            .map(|both| both.map(|(name, text)| format!("{name} {text}")).join(", "))
        };
        let (gage, cylinder) = ("m1/sensor/g1", "m1/actuator/a1");
        for (component, symptom, value, expected) in [
            (gage, Symptom::Change, 6e-4, "residual +600.00 µm, divergence 22.9 × threshold"),
            (cylinder, Symptom::Change, -12.0, "residual -12.0 N, divergence 22.9 × threshold"),
            (cylinder, Symptom::Departure, -12.0, "residual -12.0 N, score 22.9 × its threshold"),
            (
                cylinder,
                Symptom::OilContent,
                8_324_771.6,
                "oil content +83.25 bar, score 22.9 × its threshold",
            ),
            (
                gage,
                Symptom::Reading,
                -0.1234567,
                "too large by -0.1235, score 22.9 × its threshold",
            ),
            (gage, Symptom::Scatter, 9e-7, "noise 0.90 µm, score 22.9 × its threshold"),
        ] {
            assert_eq!(words(component, symptom, value).as_deref(), Some(expected));
        }
        assert_eq!(words(gage, Symptom::NoSignal, 1.0), None);
    }

    #[test]
    fn forces_are_printed_as_they_were_ordered() {
        assert_eq!([50e3, 1250.0, 40.5].map(force), ["50 kN", "1.25 kN", "40.5 N"]);
    }

    #[test]
    fn spans_are_printed_in_the_unit_that_suits_them() {
        let spans = [0.25, 42.4, 999.6, 119_000.0, 600_000.0, 8_000_000.0];
        let expected = ["0.2 ms", "42 ms", "1.0 s", "119.0 s", "10.0 min", "2.2 h"];
        assert_eq!(spans.map(span), expected);
        assert_eq!(spans.map(|ms| span(-ms)), expected.map(|text| format!("-{text}")));
    }
}
