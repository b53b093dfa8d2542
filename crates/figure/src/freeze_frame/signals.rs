//! The traces of a frame, and the units and times in which they are shown.

use vocabulary::words::in_small_units;
use vocabulary::{FreezeFrame, Trace};

/// The traces of this name or, of another kind of component, that one.
#[must_use]
pub fn trace<'a>(frame: &'a FreezeFrame, names: &[&str]) -> Option<&'a Trace> {
    names.iter().find_map(|name| frame.signals.traces.iter().find(|trace| trace.name == *name))
}

/// The unit that a trace is shown in, and how many of it are one of the trace's.
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
    // To the nanosecond: the time of a step is not a number that comes out even.
    (1e9 * steps as f64 * frame.signals.step_s).round() / 1e9
}

/// D/γ at each step, not a number where it is undefined.
#[must_use]
pub fn ratios(frame: &FreezeFrame) -> Vec<f64> {
    let values = trace(frame, &["divergence"]).map_or(&[][..], |trace| &trace.values);
    values
        .iter()
        .map(|value| value.map_or(f64::NAN, |value| value / frame.signals.threshold))
        .collect()
}
