//! The close-up of one component: state, reason, kind of fault; residual and divergence around the onset and now.

use observer::{StateRow, known_identification};
use ratatui::layout::Rect;
use vocabulary::words::{
    NOTHING, Tone, age, candidate, identified, in_small_units, percent, printable, utc,
};
use vocabulary::{FaultTransition, FreezeFrame, Trace};

use super::cells::{Cells, folded, part};
use super::palette::symbol;
use super::plot::{self, Plot};
use crate::model::Model;
use crate::model::close_up::{CloseUp, Fetched};

/// Width of the fact names, in columns.
const NAMES: u16 = 10;
/// Most lines of a reason.
const REASON: usize = 3;

pub(super) fn draw(model: &Model, seen: &CloseUp, area: Rect, cells: &mut Cells) {
    let Some(present) = model.shown().state_of(&seen.subject) else {
        let text = format!("{} is no longer reported", seen.subject.component);
        return cells.text(area, 0, &text, cells.palette.tone(Tone::Alarm));
    };
    let row = StateRow::of_component(present);
    title(&row, model.shown_unix_ns(), area, cells);
    let mut line = 1;
    for (name, text) in facts(&row, present, seen) {
        let place = Rect { x: area.x + NAMES, width: area.width - NAMES, ..area };
        cells.text(Rect { width: NAMES, ..area }, line, name, cells.palette.dim());
        for text in folded(&text, place.width, REASON) {
            cells.text(place, line, &text, cells.palette.plain());
            line += 1;
        }
    }
    plots(seen, part(area, line, area.height), cells);
}

fn title(row: &StateRow, now_unix_ns: u64, area: Rect, cells: &mut Cells) {
    let (symbol, name, state) = (symbol(row.urgency), row.name(), &row.state);
    let structure = row.structure.as_ref().map_or("", |name| name.as_str());
    let since = row.since_unix_ns.map(|since| format!(" for {}", age(since, now_unix_ns)));
    let title = format!("{symbol} {name} of {structure}: {state}{}", since.unwrap_or_default());
    let style = cells.palette.tone(row.tone);
    cells.text(area, 0, &title, style.add_modifier(ratatui::style::Modifier::REVERSED));
}

fn facts(row: &StateRow, present: &FaultTransition, seen: &CloseUp) -> Vec<(&'static str, String)> {
    let measured = &row.measured;
    let steps = [
        ("onset step", measured.onset_step),
        ("detection", measured.detection_step),
        ("decided", measured.decided_step),
    ];
    let steps = steps.iter().filter_map(|(what, step)| Some(format!("{what} {}", (*step)?)));
    let evidence = measured.at_detection.as_ref().map(|both| {
        let both = both.iter().map(|(name, text)| format!("{name} {text}"));
        format!("at detection: {}", both.collect::<Vec<_>>().join(", "))
    });
    let facts = [
        ("since", row.since_unix_ns.map(utc)),
        ("steps", Some(steps.collect::<Vec<_>>().join(", "))),
        ("evidence", evidence),
        ("kind", what_it_is(present, seen)),
        ("why", Some(if row.why.is_empty() { NOTHING.to_owned() } else { row.why.clone() })),
    ];
    let known = facts.into_iter().filter_map(|(name, text)| Some((name, text?)));
    known.filter(|(_, text)| !text.is_empty()).collect()
}

/// The latest identification, with the alternatives.
fn what_it_is(present: &FaultTransition, seen: &CloseUp) -> Option<String> {
    if !present.state().is_fault() {
        return None;
    }
    let found = match &seen.identification {
        Fetched::Here(found) => found.as_deref(),
        Fetched::Missing(why) => return Some(format!("not available: {}", printable(why))),
        Fetched::Awaited => None,
    };
    let Some(found) = found.or(known_identification(present)) else {
        return Some("not identified yet".to_owned());
    };
    let others = found.candidates.iter().skip(usize::from(found.kind().is_some())).take(2);
    let others: Vec<String> =
        others.map(|one| format!("{} {}", candidate(one), percent(one.probability))).collect();
    let others =
        if others.is_empty() { String::new() } else { format!("; else {}", others.join(", ")) };
    Some(format!("{}{others}", identified(found)))
}

fn plots(seen: &CloseUp, area: Rect, cells: &mut Cells) {
    let upper = part(area, 0, area.height / 2);
    let lower = part(area, area.height / 2, area.height);
    let halves = |area: Rect| {
        let width = area.width / 2;
        [Rect { width, ..area }, Rect { x: area.x + width, width: area.width - width, ..area }]
    };
    let [onset_residual, latest_residual] = halves(upper);
    let [onset_ratio, latest_ratio] = halves(lower);
    let [first, second] = of_frame(&seen.frame);
    plot::draw(&first, onset_residual, cells);
    plot::draw(&second, onset_ratio, cells);
    let [first, second] = of_latest(seen);
    plot::draw(&first, latest_residual, cells);
    plot::draw(&second, latest_ratio, cells);
}

/// Plots of the freeze frame, around the onset.
fn of_frame(frame: &Fetched<Box<FreezeFrame>>) -> [Plot; 2] {
    let empty = |title: &str, why: &str| Plot {
        title: title.to_owned(),
        otherwise: why.to_owned(),
        ..Plot::default()
    };
    let titles = ["residual, at the onset", "D/γ, power of ten, at the onset"];
    let frame = match frame {
        Fetched::Here(frame) => frame,
        Fetched::Awaited => return titles.map(|title| empty(title, "no answer yet")),
        Fetched::Missing(why) => return titles.map(|title| empty(title, &printable(why))),
    };
    let marks: Vec<f64> = [frame.signals.onset_step, frame.signals.detection_step]
        .map(|step| number(step.0))
        .to_vec();
    let unit = trace(frame, "residual").map(|trace| in_small_units(&trace.unit));
    let (scale, unit) = unit.unwrap_or((1.0, String::new()));
    let residuals = points(frame, "residual", |value| scale * value);
    let powers = points(frame, "divergence", |value| (value / frame.signals.threshold).log10());
    let title = format!("residual [{unit}], ┊ onset and detection");
    let nothing = "the freeze frame has none".to_owned();
    [
        Plot {
            title,
            points: residuals,
            marks: marks.clone(),
            otherwise: nothing.clone(),
            ..Plot::default()
        },
        Plot {
            title: "D/γ, power of ten, ╌ threshold".to_owned(),
            points: powers,
            level: Some(0.0),
            marks,
            otherwise: nothing,
            ..Plot::default()
        },
    ]
}

fn trace<'a>(frame: &'a FreezeFrame, name: &str) -> Option<&'a Trace> {
    frame.signals.traces.iter().find(|trace| trace.name == name)
}

fn points(frame: &FreezeFrame, name: &str, of: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let values = trace(frame, name).map_or(&[][..], |trace| &trace.values);
    let steps = frame.signals.steps.iter().map(|step| number(step.0));
    steps.zip(values).map(|(step, value)| (step, value.map_or(f64::NAN, &of))).collect()
}

/// Plots of the divergences as they arrive.
fn of_latest(seen: &CloseUp) -> [Plot; 2] {
    let own_unit = seen.latest.back().is_some_and(|latest| latest.own_unit);
    let (scale, unit) = match seen.subject.component.component.kind() {
        _ if own_unit => (1.0, "unit of the reading"),
        vocabulary::ComponentKind::Sensor => (1e6, "µm"),
        vocabulary::ComponentKind::Actuator => (1.0, "N"),
    };
    let latest = || seen.latest.iter();
    let residuals = latest().map(|one| (number(one.step), scale * one.residual)).collect();
    let powers = latest().map(|one| (number(one.step), one.ratio.log10())).collect();
    let nothing = "nothing received yet".to_owned();
    [
        Plot {
            title: format!("residual [{unit}], as published"),
            points: residuals,
            otherwise: nothing.clone(),
            ..Plot::default()
        },
        Plot {
            title: "D/γ, power of ten, as published".to_owned(),
            points: powers,
            level: Some(0.0),
            otherwise: nothing,
            ..Plot::default()
        },
    ]
}

#[expect(clippy::cast_precision_loss, reason = "a drawing")]
fn number(step: u64) -> f64 {
    step as f64
}
