//! A freeze frame drawn with characters.

use freeze_chart::{ratios, shown_in, trace};
use wire::{FreezeFrame, Trace};

use crate::chart::{Curve, curve};
use crate::paint::Paint;

/// What was measured, the residual and the divergence, with what the marks on their axes are.
pub(in crate::fault) fn text(frame: &FreezeFrame, width: u16, paint: Paint) -> String {
    let width = usize::from(width);
    let measured = trace(frame, &["reading", "force"]);
    let residual = trace(frame, &["residual"]);
    let mut parts = vec![format!("  freeze frame of transition {}\n", frame.sequence)];
    parts.extend(
        [measured, residual]
            .into_iter()
            .flatten()
            .map(|trace| of_trace(frame, trace))
            .map(|drawn| curve(&drawn, width, paint)),
    );
    parts.push(curve(&of_divergence(frame), width, paint));
    let marks = [
        ("onset", frame.onset_step),
        ("detection", frame.detection_step),
        ("latched as of", frame.decided_step),
    ];
    let marks = marks.map(|(name, step)| format!("  ┴ {name} step {step}\n"));
    parts.push(marks.concat());
    parts.retain(|part| !part.is_empty());
    parts.join("\n")
}

fn marks(frame: &FreezeFrame) -> Vec<u64> {
    [frame.onset_step, frame.detection_step, frame.decided_step].map(|step| step.0).to_vec()
}

fn of_trace(frame: &FreezeFrame, trace: &Trace) -> Curve {
    let (scale, unit) = shown_in(trace);
    let values = trace.values.iter().map(|value| value.map_or(f64::NAN, |value| scale * value));
    Curve {
        title: format!("{} [{unit}]", names::printable(&trace.name)),
        points: frame.steps.iter().map(|step| step.0).zip(values).collect(),
        level: None,
        marks: marks(frame),
    }
}

/// By powers of ten: it grows with the fourth power of what the residual is off.
fn of_divergence(frame: &FreezeFrame) -> Curve {
    let powers = ratios(frame).into_iter().map(f64::log10);
    Curve {
        title: "divergence over threshold, power of ten".to_owned(),
        points: frame.steps.iter().map(|step| step.0).zip(powers).collect(),
        level: Some((0.0, "threshold")),
        marks: marks(frame),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use freeze_chart::testing::frame;

    #[test]
    fn a_frame_is_drawn_like_this() {
        let expected = "  freeze frame of transition 7

  reading [µm]
  46 ┤                      ⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉
     │
     │
     │
  24 ┤
     │
     │
   1 ┤⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀
     └──────────────────────┴──────────┴──────────
      step 1000                               1199

  residual [µm]
  45 ┤                      ⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉
     │
     │
     │
  22 ┤
     │
     │
   0 ┤⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀⣀
     └──────────────────────┴──────────┴──────────
      step 1000                               1199

  divergence over threshold, power of ten
  2.0 ┤                     ⠈⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉⠉
      │
      │
      │
  1.0 ┤
      │
      │
  0.0 ┤───────────────────────────────────────────
      └─────────────────────┴┴─────────┴──────────
       step 1000                              1199

  ┴ onset step 1100
  ┴ detection step 1102
  ┴ latched as of step 1150
";
        let text = text(&frame(), 50, Paint::for_terminal(false));
        assert_eq!(text, expected, "\n{text}");
    }

    #[test]
    fn it_fits_the_terminal() {
        for width in [40, 80, 120] {
            let text = text(&frame(), width, Paint::for_terminal(false));
            let widest = text.lines().map(|line| line.chars().count()).max();
            assert!(widest <= Some(usize::from(width).max(42)), "{text}");
        }
    }
}
