//! The freeze frame of a component's fault: what was seen around its latching.
//!
//! | file | job |
//! |---|---|
//! | `terminal` | drawn with characters |
//! | `drawing` | drawn as SVG |
//! | `rows` | as CSV |

mod drawing;
mod rows;
mod terminal;

pub(super) use drawing::svg;
pub(super) use rows::csv;
pub(super) use terminal::text;

use std::time::Duration;

use observer::QueryError;
use wire::{FaultTransition, FreezeFrame, Trace};
use zenoh::Session;

use wording::{in_small_units, printable};

/// The frame of the fault that a component has, or why there is none.
pub(super) async fn fetch(
    session: &Session,
    found: &FaultTransition,
    timeout: Duration,
) -> Result<FreezeFrame, String> {
    let (structure, module) = (&found.structure, &found.module);
    let kept = observer::freeze_frames(session, structure, module, timeout).await;
    let kept = kept.map_err(|error| why(&error))?;
    let Some(head) = kept.iter().find(|frame| is_of(frame, found)) else {
        return Err("none of this fault is kept: it takes until two seconds after the latching, \
                    and only the latest are kept"
            .to_owned());
    };
    let frame = observer::freeze_frame(session, structure, module, head.sequence, timeout).await;
    match frame {
        Ok(frame) if is_of(&frame, found) => Ok(frame),
        Ok(frame) => Err(format!("the answer is of another fault, of {}", frame.component)),
        Err(error) => Err(why(&error)),
    }
}

/// An acknowledgement is a transition of its own, on the same onset.
fn is_of(frame: &FreezeFrame, found: &FaultTransition) -> bool {
    frame.component == found.component
        && frame.incarnation == found.incarnation
        && found.run.is_none_or(|run| run == frame.run)
        && Some(frame.onset_step) == found.onset_step
        && frame.sequence <= found.sequence
}

fn why(error: &QueryError) -> String {
    match error {
        QueryError::Refused(reason) => printable(reason),
        QueryError::Unanswered(_) => "its module gives none".to_owned(),
        other => printable(&other.to_string()),
    }
}

/// The traces of this name or, of another kind of component, that one.
fn trace<'a>(frame: &'a FreezeFrame, names: &[&str]) -> Option<&'a Trace> {
    names.iter().find_map(|name| frame.traces.iter().find(|trace| trace.name == *name))
}

/// The unit that a trace is shown in, and how many of it are one of the trace's.
fn shown_in(trace: &Trace) -> (f64, String) {
    match trace.unit.as_str() {
        "N" => (1e-3, "kN".to_owned()),
        "Pa" => (1e-5, "bar".to_owned()),
        other => in_small_units(other),
    }
}

/// Seconds since the detection.
#[expect(clippy::cast_precision_loss, reason = "some seconds")]
fn seconds(frame: &FreezeFrame, step: u64) -> f64 {
    let steps = i128::from(step) - i128::from(frame.detection_step.0);
    // To the nanosecond: the time of a step is not a number that comes out even.
    (1e9 * steps as f64 * frame.step_s).round() / 1e9
}

/// D/γ at each step, not a number where it is undefined.
fn ratios(frame: &FreezeFrame) -> Vec<f64> {
    let values = trace(frame, &["divergence"]).map_or(&[][..], |trace| &trace.values);
    values.iter().map(|value| value.map_or(f64::NAN, |value| value / frame.threshold)).collect()
}

#[cfg(test)]
pub(super) mod testing {
    use names::{RunId, Step};
    use wire::{FreezeFrame, Trace};

    /// A gage's frame: 0.2 s with a jump in the middle, and a step that is missing.
    pub(crate) fn frame() -> FreezeFrame {
        let steps: Vec<u64> = (1000..1200).filter(|step| *step != 1010).collect();
        let trace = |name: &str, unit: &str, [before, after]: [f64; 2]| Trace {
            name: name.to_owned(),
            unit: unit.to_owned(),
            values: steps
                .iter()
                .map(|step| Some(if *step < 1100 { before } else { after }))
                .map(|value| value.filter(|value| value.is_finite()))
                .collect(),
        };
        FreezeFrame {
            structure: "tower".parse().unwrap(),
            module: "m1".parse().unwrap(),
            component: "m1/sensor/g2".parse().unwrap(),
            sequence: 7,
            incarnation: None,
            run: RunId(3),
            step_s: 1e-3,
            onset_step: Step(1100),
            detection_step: Step(1102),
            decided_step: Step(1150),
            threshold: 0.5,
            time_unix_ns: 1_000_000_000,
            traces: vec![
                trace("reading", "m", [1e-6, 46e-6]),
                trace("residual", "m", [0.0, 45e-6]),
                trace("divergence", "1", [f64::NAN, 50.0]),
            ],
            steps: steps.iter().map(|step| Step(*step)).collect(),
        }
    }
}
