//! The traces of a frame, with the units and times in which they are displayed.

use vocabulary::words::in_small_units;
use vocabulary::{FreezeFrame, Trace};

/// The first trace found under these names, which depend on the kind of component.
#[must_use]
pub fn trace<'a>(frame: &'a FreezeFrame, names: &[&str]) -> Option<&'a Trace> {
    names.iter().find_map(|name| frame.signals.traces.iter().find(|trace| trace.name == *name))
}

/// The display unit of a trace, and the factor from the trace's unit to it.
#[must_use]
pub fn shown_in(trace: &Trace) -> (f64, String) {
    match trace.unit.as_str() {
        "N" => (1e-3, "kN".to_owned()),
        "Pa" => (1e-5, "bar".to_owned()),
        other => in_small_units(other),
    }
}

/// Seconds from the detection to this step \[s\].
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "some seconds")]
pub fn seconds(frame: &FreezeFrame, step: u64) -> f64 {
    let steps = i128::from(step) - i128::from(frame.signals.detection_step.0);
    // Rounded to the nanosecond, because the duration of a step is not exact in binary.
    (1e9 * steps as f64 * frame.signals.step_s).round() / 1e9
}

/// D/γ at each step; NaN where undefined.
#[must_use]
pub fn ratios(frame: &FreezeFrame) -> Vec<f64> {
    let values = trace(frame, &["divergence"]).map_or(&[][..], |trace| &trace.values);
    values
        .iter()
        .map(|value| value.map_or(f64::NAN, |value| value / frame.signals.threshold))
        .collect()
}
