//! Share of faults whose kind is undecided, against their size.

use figure::plot::{Figure, Panel, PanelRow, PlotAxis, Series, SeriesStyle, Shape};
use vocabulary::IdentifiedKind;

use crate::identification::{
    IdentificationSummary, SIZES_IN_LIMITS, UNDECIDED_AFTER_S, UndecidedBySize,
};

const HEIGHT_PX: f64 = 150.0;

/// The shares as SVG: a panel for each time since the component was declared faulty, a line for each kind with a size.
/// Sizes are in limits of their kind.
#[must_use]
pub fn identification_figure(tally: &IdentificationSummary) -> String {
    let last = UNDECIDED_AFTER_S.len() - 1;
    let panel = |when: usize| {
        let x = PlotAxis::log("size, in limits of its kind")
            .over([SIZES_IN_LIMITS[0], SIZES_IN_LIMITS[SIZES_IN_LIMITS.len() - 1]]);
        let x = if when < last { x.bare() } else { x };
        let y = PlotAxis::linear("undecided").over([-0.02, 1.02]);
        let series = tally.undecided.iter().enumerate();
        let series = series.map(|(place, (kind, rows))| line(place, *kind, rows, when));
        Panel::new(format!("after {} s", UNDECIDED_AFTER_S[when]), x, y, series.collect())
    };
    let figure = Figure {
        title: "Faults whose kind is undecided".to_owned(),
        subtitle: "Share of the faults whose component was declared faulty, by size, so long after that. A size of one is \
                   the smallest that is found within about two seconds."
            .to_owned(),
        description: sentences(tally).join(" "),
        rows: (0..=last).map(|when| PanelRow::new(HEIGHT_PX, vec![panel(when)])).collect(),
    };
    figure.svg()
}

fn line(place: usize, kind: IdentifiedKind, rows: &[UndecidedBySize], when: usize) -> Series {
    let point = |row: &UndecidedBySize| {
        [(row.from * row.to).sqrt(), row.undecided[when] as f64 / row.named as f64]
    };
    let measured = rows.iter().filter(|row| row.named > 0).map(point).collect();
    Series::new(kind.words(), Shape::MarkedLine, SeriesStyle::nth(place).solid(), measured)
}

fn sentences(tally: &IdentificationSummary) -> Vec<String> {
    let sentence = |(kind, rows): (&IdentifiedKind, &Vec<UndecidedBySize>)| {
        let named: u64 = rows.iter().map(|row| row.named).sum();
        let open = |when: usize| rows.iter().map(|row| row.undecided[when]).sum::<u64>();
        let each = UNDECIDED_AFTER_S.iter().enumerate();
        let each: Vec<String> =
            each.map(|(when, time)| format!("{} after {time} s", open(when))).collect();
        format!("{}: of {named} undecided {}.", kind.words(), each.join(", "))
    };
    tally.undecided.iter().map(sentence).collect()
}
