//! What the top of a structure does with a fault, and with what is done about it.

use figure::plot::{Figure, Panel, PanelRow, PlotAxis, Series, SeriesStyle, Shape};

use crate::tolerance::{Measure, TRACE_EVERY_S, ToleranceRow};

const HEIGHT_PX: f64 = 240.0;
const MILLIMETRES_PER_MICROMETRE: f64 = 1e-3;

/// The displacement of the top in the direction in which the fault moves it more, as SVG: without the fault, with nothing
/// done about it, and with each measure.
#[must_use]
pub fn tolerance_figure(row: &ToleranceRow) -> String {
    let nothing = row.relative.get(&Measure::Nothing).map_or(&[][..], |motion| &motion.top_um);
    let range = |axis: usize| {
        let values = || nothing.iter().map(|top_um| top_um[axis]);
        values().max().unwrap_or(0) - values().min().unwrap_or(0)
    };
    let axis = usize::from(range(1) > range(0));
    let points = |top_um: &[[i32; 2]]| -> Vec<[f64; 2]> {
        let times = (0..).map(|number| f64::from(number) * TRACE_EVERY_S);
        let millimetres = |um: &[i32; 2]| f64::from(um[axis]) * MILLIMETRES_PER_MICROMETRE;
        times.zip(top_um).map(|(time_s, um)| [time_s, millimetres(um)]).collect()
    };
    let line = |place: usize, name: &str, top_um: &[[i32; 2]]| {
        Series::new(name, Shape::Line, SeriesStyle::nth(place), points(top_um))
    };
    let mut series = vec![line(0, "without the fault", &row.without_fault.top_um)];
    let measures = row.relative.iter().enumerate();
    series.extend(
        measures.map(|(place, (measure, motion))| line(place + 1, measure.words(), &motion.top_um)),
    );
    let what = format!("{} of {}", row.fault, row.component);
    let y = PlotAxis::linear("top [mm]");
    let panel = Panel::new(what.clone(), PlotAxis::linear("time since the onset [s]"), y, series);
    let times = |measure: &Measure| {
        let motion = row.relative.get(measure)?;
        Some(format!("{}: {:.2} times its motion.", measure.words(), motion.rms_top_m))
    };
    let sentences: Vec<String> = Measure::ALL.iter().filter_map(times).collect();
    let figure = Figure {
        title: "The top with a fault".to_owned(),
        subtitle: "The case in which the fault moved the top most, relative to the run without it."
            .to_owned(),
        description: format!("{what}. {}", sentences.join(" ")),
        rows: vec![PanelRow::new(HEIGHT_PX, vec![panel])],
    };
    figure.svg()
}
