//! Smallest fault against time, for both detectors and each weather.

use figure::plot::{Figure, Panel, PanelRow, PlotAxis, Series, SeriesStyle, Shape, ticks};

use crate::limits::{LimitCurve, LimitDetector, SizedKind, Within, curves};

/// The axis of times \[s\]: from one step to the duration of a run.
const TIMES_S: [f64; 2] = [1e-3, 30.0];
/// Space above the largest and below the smallest size, as a factor.
const ROOM: f64 = 1.25;
const HEIGHT_PX: f64 = 160.0;
/// Line width of the first weather, reduced for each further one \[px\].
const WIDEST_PX: f64 = 3.4;
const WIDTH_STEP_PX: f64 = 1.1;

/// The limits as SVG: for each kind of fault the smallest size found in 95 % of the runs against time, both
/// logarithmic; for a bias also the smallest one whose gage is identified. One line for each detector and weather.
#[must_use]
pub fn limits_figure(all: &[LimitCurve]) -> String {
    let of_kind = |kind| {
        let found = panel(all, kind, "found", |curve| &curve.found);
        let right =
            (kind == SizedKind::Bias).then(|| panel(all, kind, "right", |curve| &curve.right));
        [Some(found), right].into_iter().flatten()
    };
    let mut panels: Vec<Panel> = SizedKind::ABSOLUTE.iter().copied().flat_map(of_kind).collect();
    let last = panels.len() - 1;
    for panel in &mut panels[..last] {
        panel.x = panel.x.clone().bare();
    }
    let figure = Figure {
        title: "Smallest fault against time".to_owned(),
        subtitle: "Smallest size reached in 95\u{a0}% of the runs within a time. Change detector: the fault jumps in; \
                   reference: it is there from the first sample on. Found: a change that nothing explains, \
                   declared faulty, or one of several suspects; right: declared faulty, or the likeliest of them."
            .to_owned(),
        description: sentences(all).join(" "),
        rows: panels.into_iter().map(|panel| PanelRow::new(HEIGHT_PX, vec![panel])).collect(),
    };
    figure.svg()
}

fn panel(
    all: &[LimitCurve],
    kind: SizedKind,
    what: &str,
    of: fn(&LimitCurve) -> &[Within],
) -> Panel {
    let mut weathers: Vec<&str> = all.iter().map(|curve| curve.weather.as_str()).collect();
    weathers.dedup();
    let place = |curve: &LimitCurve| weathers.iter().position(|other| *other == curve.weather);
    let series = curves(all, kind).flat_map(|curve| {
        let name = format!("{}, {}", curve.detector.title(), curve.weather);
        series(&name, stroke(place(curve).unwrap_or(0), curve.detector), of(curve))
    });
    let sizes = kind.sizes();
    let ends = [sizes[0] / ROOM, sizes[sizes.len() - 1] * ROOM];
    let x = PlotAxis::log("time [s]").over(TIMES_S);
    let y = PlotAxis::log(format!("size [{}]", kind.unit())).over(ends);
    Panel::new(format!("{}, {what}", kind.title()), x, y, series.collect())
}

/// A colour, marker and width for each weather, so that overlapping lines are visible; dotted for the detector that
/// needs a jump.
fn stroke(place: usize, detector: LimitDetector) -> SeriesStyle {
    let stroke = SeriesStyle::nth(place).solid();
    let stroke = match detector {
        LimitDetector::Change => stroke.dotted(),
        LimitDetector::Reference | LimitDetector::Isolation => stroke,
    };
    SeriesStyle { width: (WIDEST_PX - WIDTH_STEP_PX * place as f64).max(1.0), ..stroke }
}

/// A staircase, because a size applies from its time until the next, with markers at measured points.
fn series(name: &str, stroke: SeriesStyle, curve: &[Within]) -> [Series; 3] {
    let measured: Vec<[f64; 2]> = curve.iter().map(|step| [step.within_s, step.size]).collect();
    let untils = measured.iter().skip(1).map(|[time, _]| *time).chain([TIMES_S[1]]);
    let stairs = measured.iter().zip(untils).flat_map(|(step, until)| [*step, [until, step[1]]]);
    [
        // Only the legend shows line and marker together, because a staircase has no markers at its inner corners.
        Series::new(name, Shape::MarkedLine, stroke, Vec::new()),
        Series::new("", Shape::Line, stroke, stairs.collect()),
        Series::new("", Shape::Dots, stroke, measured),
    ]
}

/// The smallest size of every curve, in words.
fn sentences(all: &[LimitCurve]) -> Vec<String> {
    let all = SizedKind::ABSOLUTE.iter().flat_map(|kind| curves(all, *kind));
    let sentence = |curve: &LimitCurve| {
        let (kind, detector) = (curve.kind.title(), curve.detector.title());
        let who = format!("{kind}, {detector}, weather {}", curve.weather);
        match curve.found.last() {
            Some(Within { within_s, size }) => {
                let (size, time) = (ticks::short(*size), ticks::short(*within_s));
                format!("{who}: {size} {} found within {time} s.", curve.unit)
            }
            None => format!("{who}: no size tried is found in 95 % of the runs."),
        }
    };
    all.map(sentence).collect()
}
