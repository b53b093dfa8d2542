//! The freeze frame of a component's fault, as a text plot and as CSV.

use figure::freeze_frame::{ratios, seconds, shown_in, trace};
use terminal::Plot;
use vocabulary::{FreezeFrame, Step, Trace};

use crate::paint::Paint;

/// Lines of a plot: title, curve, steps.
const LINES: u16 = 10;
/// Maximum width of a plot: in a wider one the dots would be too sparse.
pub(super) const WIDEST: u16 = 100;

/// Plots of the measured signal, the residual and the divergence, with the meaning of their marks.
pub(super) fn text(frame: &FreezeFrame, width: u16, paint: Paint) -> String {
    let measured = trace(frame, &["reading", "force"]);
    let residual = trace(frame, &["residual"]);
    let traces = [measured, residual].into_iter().flatten().map(|trace| of_trace(frame, trace));
    let plots = traces.chain([of_divergence(frame)]);
    let mut parts = vec![format!("  freeze frame of transition {}\n", frame.signals.sequence)];
    let colours = paint.has_colours();
    parts.extend(plots.map(|plot| plot.text(width.min(WIDEST), LINES, colours)));
    let marks = [
        ("onset", frame.signals.onset_step),
        ("detection", frame.signals.detection_step),
        ("latched as of", frame.signals.decided_step),
    ];
    parts.push(marks.map(|(name, step)| format!("  ┊ {name} step {step}\n")).concat());
    parts.join("\n")
}

fn plot(frame: &FreezeFrame, title: String, values: impl Iterator<Item = f64>) -> Plot {
    let marks =
        [frame.signals.onset_step, frame.signals.detection_step, frame.signals.decided_step];
    Plot {
        title: format!("  {title}"),
        points: frame.signals.steps.iter().map(|step| number(*step)).zip(values).collect(),
        marks: marks.map(number).to_vec(),
        otherwise: "no values".to_owned(),
        ..Plot::default()
    }
}

#[expect(clippy::cast_precision_loss, reason = "a drawing")]
fn number(step: Step) -> f64 {
    step.0 as f64
}

fn of_trace(frame: &FreezeFrame, trace: &Trace) -> Plot {
    let (scale, unit) = shown_in(trace);
    let values = trace.values.iter().map(|value| value.map_or(f64::NAN, |value| scale * value));
    plot(frame, format!("{} [{unit}]", vocabulary::printable(&trace.name)), values)
}

/// The plot is logarithmic, because the divergence grows with the fourth power of the residual's deviation.
fn of_divergence(frame: &FreezeFrame) -> Plot {
    let powers = ratios(frame).into_iter().map(f64::log10);
    let title = "divergence over threshold (╌), power of ten".to_owned();
    Plot { level: Some(0.0), ..plot(frame, title, powers) }
}

/// Columns: the step, the time since the detection, and the traces, with units in the header; a missing value is empty.
pub(super) fn csv(frame: &FreezeFrame) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let named = frame.signals.traces.iter().map(|trace| format!("{} [{}]", trace.name, trace.unit));
    writer.write_record(
        ["step".to_owned(), "since detection [s]".to_owned()].into_iter().chain(named),
    )?;
    for (row, step) in frame.signals.steps.iter().enumerate() {
        let values = frame.signals.traces.iter().map(|trace| {
            let value = trace.values.get(row).copied().flatten();
            value.map_or_else(String::new, |value| value.to_string())
        });
        let time = seconds(frame, step.0);
        writer.write_record([step.to_string(), time.to_string()].into_iter().chain(values))?;
    }
    writer.into_inner().map_err(|error| csv::Error::from(error.into_error()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use figure::freeze_frame::testing::frame;

    #[test]
    fn a_frame_is_drawn_like_this() {
        let expected = "  freeze frame of transition 7

  reading [µm]
      46┤                    ⢸⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉
        │                    ⢸┊        ┊
        │                    ⢸┊        ┊
        │                    ⢸┊        ┊
        │                    ⡇┊        ┊
        │                    ⡇┊        ┊
        │                    ⡇┊        ┊
       1┤⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⡇┊        ┊
         step 1000           ┊┊        ┊      1199

  residual [µm]
      45┤                    ⢸⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉
        │                    ⢸┊        ┊
        │                    ⢸┊        ┊
        │                    ⢸┊        ┊
        │                    ⡇┊        ┊
        │                    ⡇┊        ┊
        │                    ⡇┊        ┊
       0┤⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⡇┊        ┊
         step 1000           ┊┊        ┊      1199

  divergence over threshold (╌), power of ten
     2.0┤                    ⠈⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉
        │                    ┊┊        ┊
        │                    ┊┊        ┊
        │                    ┊┊        ┊
        │                    ┊┊        ┊
        │                    ┊┊        ┊
        │                    ┊┊        ┊
     0.0┤╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌╌
         step 1000           ┊┊        ┊      1199

  ┊ onset step 1100
  ┊ detection step 1102
  ┊ latched as of step 1150
";
        let text = text(&frame(), 50, Paint::NONE);
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn it_fits_the_terminal() {
        for width in [40, 80, 120] {
            let text = text(&frame(), width, Paint::NONE);
            let widest = text.lines().map(|line| line.chars().count()).max();
            assert!(widest <= Some(usize::from(width).max(42)), "{text}");
        }
    }

    #[test]
    fn every_step_has_a_row_and_what_is_undefined_is_empty() {
        let text = String::from_utf8(csv(&frame()).unwrap()).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "step,since detection [s],reading [m],residual [m],divergence [1]");
        assert_eq!(lines[1], "1000,-0.102,0.000001,0,");
        assert_eq!(lines[199], "1199,0.097,0.000046,0.000045,50");
        assert_eq!(lines.len(), 200);
    }
}
