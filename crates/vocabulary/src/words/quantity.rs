//! Quantities with their units.

use crate::ComponentKind;

/// A residual in the unit that suits it: N for an actuator, µm for a gage.
pub fn residual(kind: ComponentKind, value: f64) -> String {
    match kind {
        ComponentKind::Actuator => format!("{value:+.1} N"),
        ComponentKind::Sensor => format!("{:+.2} µm", value * 1e6),
    }
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
