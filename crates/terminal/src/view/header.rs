//! Structure, counts, network; whether what is shown is current.

use std::collections::BTreeSet;

use observer::{NetworkState, Scene, Urgency};
use ratatui::layout::Rect;
use ratatui::style::Modifier;
use wire::FaultState;
use wording::{Tone, printable};

use super::age::span;
use super::cells::Cells;
use crate::model::{Model, Standing};

/// A picture older than this is not current \[ns\].
const OLD_NS: u64 = 3_000_000_000;

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let scene = model.shown();
    let title = format!("trusswatch  {}", structures(model, scene));
    cells.text(area, 0, &title, cells.palette.heading(false));
    let (tone, network) = network(model);
    cells.right(area, 0, &format!(" {network}"), cells.palette.tone(tone));
    cells.text(area, 1, &counts(scene), cells.palette.plain());
    if let Some((tone, text)) = currency(model) {
        cells.right(
            area,
            1,
            &format!(" {text} "),
            cells.palette.tone(tone).add_modifier(Modifier::REVERSED),
        );
    }
}

fn structures(model: &Model, scene: &Scene) -> String {
    let seen: BTreeSet<_> =
        scene.modules.iter().filter_map(|module| module.picture.member.structure.clone()).collect();
    match (seen.len(), &model.settings.structure) {
        (0, Some(wanted)) => wanted.to_string(),
        (0, None) => String::new(),
        (1..=3, _) => seen.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        (many, _) => format!("{many} structures"),
    }
}

fn network(model: &Model) -> (Tone, String) {
    let places = &model.settings.places;
    match &model.shown().network {
        NetworkState::Opening => (Tone::Doubt, format!("connecting to {places}")),
        NetworkState::Open => (Tone::Calm, format!("connected to {places}")),
        NetworkState::Failed(reason) => (Tone::Alarm, format!("NO NETWORK: {}", printable(reason))),
        NetworkState::Closed => (Tone::Alarm, "NETWORK LOST, connecting again".to_owned()),
    }
}

/// That the screen is frozen, or the picture old.
fn currency(model: &Model) -> Option<(Tone, String)> {
    if let Some(frozen) = model.frozen_for_ns() {
        return Some((Tone::Doubt, format!("FROZEN {}, f thaws", span(frozen))));
    }
    let age = model.picture_age_ns();
    let is_old = model.shown().number > 0 && age >= OLD_NS;
    is_old.then(|| (Tone::Alarm, format!("PICTURE IS {} OLD", span(age))))
}

/// How many components are in which state, the most urgent first; normal are only those that are known to be.
fn counts(scene: &Scene) -> String {
    let lost = scene.modules.iter().filter(|module| !Standing::of(module).is_reliable()).count();
    let mut parts = Vec::new();
    if lost > 0 {
        parts.push(format!("{lost} of {} modules not in service", scene.modules.len()));
    }
    let all = scene.components().count();
    if all == 0 {
        parts.push("nothing is known of any component".to_owned());
        return parts.join("; ");
    }
    let states: Vec<String> = states(scene)
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    parts.push(format!("{} of {all}", states.join(", ")));
    parts.join("; ")
}

fn states(scene: &Scene) -> [(usize, &'static str); 9] {
    let of = |wanted| scene.components().filter(|one| Urgency::of(one) == wanted).count();
    let normal = || scene.components().filter(|one| one.state() == FaultState::Normal);
    let verified = normal().filter(|one| one.is_verified()).count();
    [
        (of(Urgency::Latched), "latched"),
        (of(Urgency::Unconfirmed), "unconfirmed"),
        (of(Urgency::Unknown), "unknown"),
        (of(Urgency::Acknowledged), "acknowledged"),
        (of(Urgency::SetAside), "set aside"),
        (of(Urgency::Explained), "explained"),
        (of(Urgency::Tentative), "tentative"),
        (normal().count() - verified, "not verified"),
        (verified, "normal"),
    ]
}
