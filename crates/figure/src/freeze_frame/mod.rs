//! Freeze frames: measurements around the latching of a fault, as SVG text; and the traces, times and ratios of a frame
//! in display units.

pub mod testing;

use vocabulary::words::{in_small_units, utc};
use vocabulary::{FreezeFrame, Trace};

use crate::plot::{
    Figure, MarkKind, Panel, PanelMark, PanelRow, PlotAxis, Series, SeriesStyle, Shape,
};

/// Height of a plot \[px\].
const HEIGHT: f64 = 130.0;
/// Lower end of the divergence axis, in thresholds.
const LOWEST: f64 = 1e-6;

/// Draws the measured signal, the residual and the ratio of divergence to threshold; for a cylinder also the pressures.
/// Time is relative to the detection.
#[must_use]
pub fn svg(frame: &FreezeFrame) -> String {
    let panels = [
        panel(frame, "what was measured", &["reading", "demand", "force"]),
        panel(frame, "residual", &["residual"]),
        Some(divergence(frame)),
        panel(frame, "pressures", &["pressure_a", "pressure_b"]),
    ];
    let (component, structure) = (&frame.component, &frame.structure);
    let [onset, latched] =
        [frame.signals.onset_step, frame.signals.decided_step].map(|step| ms(frame, step.0));
    Figure {
        title: format!("Fault of {component}"),
        subtitle: format!(
            "{structure}, run {}, transition {}: detected at step {}, onset {onset:+.0} ms, latched as of \
             {latched:+.0} ms; {}",
            frame.signals.run,
            frame.signals.sequence,
            frame.signals.detection_step,
            utc(frame.time_unix_ns)
        ),
        description: format!(
            "What the diagnoser of {} saw of {component} around the latching of its fault: what was measured, the \
             residual, and the divergence over its threshold.",
            frame.module
        ),
        rows: panels.into_iter().flatten().map(|panel| PanelRow::new(HEIGHT, vec![panel])).collect(),
    }
    .svg()
}

/// Milliseconds since the detection.
fn ms(frame: &FreezeFrame, step: u64) -> f64 {
    1e3 * seconds(frame, step)
}

fn panel(frame: &FreezeFrame, title: &str, names: &[&str]) -> Option<Panel> {
    let traces: Vec<&Trace> = names.iter().filter_map(|name| trace(frame, &[*name])).collect();
    let (scale, unit) = shown_in(traces.first()?);
    let series = traces.iter().enumerate().map(|(place, trace)| {
        let values = trace.values.iter().map(|value| value.map_or(f64::NAN, |value| scale * value));
        let name = if traces.len() == 1 { "" } else { trace.name.as_str() };
        line(frame, name, place, values)
    });
    let y = PlotAxis::linear(format!("[{unit}]"));
    Some(marked(frame, Panel::new(title, time(), y, series.collect())))
}

fn divergence(frame: &FreezeFrame) -> Panel {
    let times = frame.signals.steps.iter().map(|step| ms(frame, step.0));
    let points = times.zip(ratios(frame)).map(|(time, ratio)| [time, ratio]);
    marked(frame, divergence_panel(time(), points.collect()))
}

/// A panel of divergences in thresholds over time, with the threshold as a level; NaN where undefined.
#[must_use]
pub fn divergence_panel(time: PlotAxis, ratios: Vec<[f64; 2]>) -> Panel {
    let values = || ratios.iter().map(|[_, ratio]| *ratio);
    let highest = values().filter(|ratio| ratio.is_finite()).fold(3.0, f64::max);
    let lowest = values().filter(|ratio| *ratio > 0.0).fold(0.1, f64::min);
    let y = PlotAxis::log("D / γ").over([lowest.max(LOWEST), 1.3 * highest]);
    let series = Series::new("", Shape::Line, SeriesStyle::nth(0).solid(), ratios);
    let level = PanelMark::new(MarkKind::Level, 1.0, "threshold");
    Panel::new("divergence over its threshold", time, y, vec![series]).marked([level])
}

fn line(
    frame: &FreezeFrame,
    name: &str,
    place: usize,
    values: impl Iterator<Item = f64>,
) -> Series {
    let times = frame.signals.steps.iter().map(|step| ms(frame, step.0));
    let points = times.zip(values).map(|(time, value)| [time, value]).collect();
    Series::new(name, Shape::Line, SeriesStyle::nth(place).solid(), points)
}

fn time() -> PlotAxis {
    PlotAxis::linear("time since the detection [ms]")
}

fn marked(frame: &FreezeFrame, panel: Panel) -> Panel {
    let shown = |step: u64| {
        frame.signals.steps.first().is_some_and(|first| first.0 <= step)
            && frame.signals.steps.last().is_some_and(|last| step <= last.0)
    };
    let marks = [
        (MarkKind::Onset, frame.signals.onset_step.0, "onset"),
        (MarkKind::Verdict, frame.signals.detection_step.0, "detection"),
        (MarkKind::Verdict, frame.signals.decided_step.0, "latched"),
    ];
    let marks = marks.into_iter().filter(|(_, step, _)| shown(*step));
    panel.marked(marks.map(|(kind, step, label)| PanelMark::new(kind, ms(frame, step), label)))
}

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

#[cfg(test)]
mod tests {
    use super::testing::frame;
    use super::*;

    #[test]
    fn the_drawing_has_a_panel_for_each_signal_and_is_the_same_every_time() {
        let drawn = svg(&frame());
        for part in ["Fault of m1/sensor/g2", "residual", "D / γ", "threshold", "onset", "latched"]
        {
            assert!(drawn.contains(part), "`{part}` is not in\n{drawn}");
        }
        assert!(drawn.starts_with("<svg") && !drawn.contains("NaN"), "{drawn}");
        assert_eq!(drawn, svg(&frame()));
        assert!(!drawn.contains("pressures"));
    }

    #[test]
    fn an_empty_frame_can_be_drawn() {
        let mut empty = frame();
        empty.signals.steps.clear();
        empty.signals.traces.iter_mut().for_each(|trace| trace.values.clear());
        assert!(svg(&empty).starts_with("<svg"));
    }
}
