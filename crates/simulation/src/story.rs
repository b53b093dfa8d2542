//! The story of a world as a picture: time to the right, a lane for each module, above them what goes wrong for all.

use std::fmt::Write as _;

use crate::scenario::{DisturbanceKind, END, WorldScenario};
use crate::setup::Setup;
use crate::world::Outcome;

const WIDTH: f64 = 1200.0;
const LEFT: f64 = 90.0;
const ROW: f64 = 15.0;
const STYLE: &str = "text { font: 11px sans-serif; fill: #222 } .axis { stroke: #888 } \
    .wrong { fill: #ddd; stroke: #999 } .fault { fill: #e7b0a0; stroke: #b5533c } \
    .mark { fill: #22506e } .violation { fill: #c00 }";

/// A bar or a mark in a lane.
struct StoryEntry {
    lane: Option<usize>,
    from_ms: f64,
    until_ms: Option<f64>,
    class: &'static str,
    words: String,
}

/// The picture as SVG.
#[must_use]
pub fn svg(setup: &Setup, scenario: &WorldScenario, outcome: &Outcome) -> String {
    let mut entries = disturbances(scenario);
    entries.extend(faults(setup, scenario));
    entries.extend(marks(setup, outcome));
    let lanes = (0..setup.modules.len()).map(Some);
    let mut body = String::new();
    let mut top = 30.0;
    for lane in [None].into_iter().chain(lanes) {
        let name = lane.map_or("all", |place| setup.modules[place].setup.module.as_str());
        let _ = write!(body, "<text x=\"8\" y=\"{:.0}\">{name}</text>", top + 11.0);
        for entry in entries.iter().filter(|entry| entry.lane == lane) {
            draw(&mut body, entry, top);
            top += ROW;
        }
        top += ROW;
        let _ = write!(
            body,
            "<line class=\"axis\" x1=\"0\" y1=\"{top:.0}\" x2=\"{WIDTH}\" y2=\"{top:.0}\"/>"
        );
        top += 6.0;
    }
    for second in (0..=END / 1000).step_by(4) {
        let x = x_of(1e3 * second as f64);
        let _ = write!(body, "<text x=\"{x:.1}\" y=\"16\">{second} s</text>");
        let _ = write!(
            body,
            "<line class=\"axis\" x1=\"{x:.1}\" y1=\"20\" x2=\"{x:.1}\" y2=\"{top:.0}\" opacity=\"0.3\"/>"
        );
    }
    for violation in &outcome.violations {
        top += ROW;
        let words = escaped(violation);
        let _ = write!(body, "<text class=\"violation\" x=\"8\" y=\"{top:.0}\">{words}</text>");
    }
    let height = top + ROW;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height:.0}\" role=\"img\">\
         <title>World of seed {}</title><style>{STYLE}</style>{body}</svg>\n",
        scenario.seed
    )
}

fn x_of(ms: f64) -> f64 {
    LEFT + (WIDTH - LEFT - 10.0) * ms / END as f64
}

fn draw(body: &mut String, entry: &StoryEntry, top: f64) {
    let x = x_of(entry.from_ms);
    let width = entry.until_ms.map_or(3.0, |until| (x_of(until) - x).max(3.0));
    let (class, words) = (entry.class, escaped(&entry.words));
    let _ = write!(
        body,
        "<rect class=\"{class}\" x=\"{x:.1}\" y=\"{:.0}\" width=\"{width:.1}\" height=\"{:.0}\"/>\
         <text x=\"{:.1}\" y=\"{:.0}\">{words}</text>",
        top + 2.0,
        ROW - 4.0,
        x + 5.0,
        top + 11.0
    );
}

fn disturbances(scenario: &WorldScenario) -> Vec<StoryEntry> {
    let entry = |one: &crate::scenario::Disturbance| StoryEntry {
        lane: lane_of(one.what),
        from_ms: one.from_ms as f64,
        until_ms: Some(one.until_ms as f64),
        class: "wrong",
        words: one.to_string(),
    };
    scenario.disturbances.iter().map(entry).collect()
}

fn faults(setup: &Setup, scenario: &WorldScenario) -> Vec<StoryEntry> {
    let ms = |step: vocabulary::Step| (step.0 * setup.step_ns()) as f64 / 1e6;
    let entry = |fault: &study::TimedFault| StoryEntry {
        lane: setup.module_names().position(|name| *name == fault.component.module),
        from_ms: ms(fault.at),
        until_ms: Some(fault.until.map_or(END as f64, ms)),
        class: "fault",
        words: format!("{}: {}", fault.component.component, fault.fault.kind()),
    };
    scenario.faults.iter().map(entry).collect()
}

/// What the modules published of their components.
fn marks(setup: &Setup, outcome: &Outcome) -> Vec<StoryEntry> {
    let entry = |line: &String| {
        let (time, words) = line.trim_start().split_once(' ')?;
        let lane = setup.module_names().position(|name| {
            words.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with('/'))
        })?;
        let is_transition = words.contains(", number ");
        let (_, words) = words.split_once('/')?;
        is_transition.then(|| StoryEntry {
            lane: Some(lane),
            from_ms: 1e3 * time.parse::<f64>().unwrap_or(0.0),
            until_ms: None,
            class: "mark",
            words: words.to_owned(),
        })
    };
    outcome.trace.lines().iter().filter_map(entry).collect()
}

fn lane_of(what: DisturbanceKind) -> Option<usize> {
    match what {
        DisturbanceKind::Kill(module)
        | DisturbanceKind::PowerLoss(module)
        | DisturbanceKind::Freeze(module)
        | DisturbanceKind::SlowProcess(module, _)
        | DisturbanceKind::Deaf(module)
        | DisturbanceKind::Mute(module)
        | DisturbanceKind::CutOff(module)
        | DisturbanceKind::SlowDisk(module, _)
        | DisturbanceKind::HungDisk(module)
        | DisturbanceKind::FullDisk(module)
        | DisturbanceKind::WrongClock(module, _)
        | DisturbanceKind::NoValue(module, _)
        | DisturbanceKind::Liar(module) => Some(module),
        _ => None,
    }
}

fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
