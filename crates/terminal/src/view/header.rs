//! Structure, counts, network, and whether the screen is current.

use std::collections::BTreeSet;

use observer::{NetworkState, Scene};
use ratatui::layout::Rect;
use ratatui::style::Modifier;
use vocabulary::words::{Tone, lasting, printable};

use super::cells::Cells;
use crate::model::Model;

/// A scene older than this is outdated \[ns\].
const OLD_NS: u64 = 3_000_000_000;

pub(super) fn draw(model: &Model, area: Rect, cells: &mut Cells) {
    let scene = model.shown();
    let title = format!("trusswatch  {}", structures(model, scene));
    cells.text(area, 0, &title, cells.palette.heading(false));
    let (tone, network) = network(model);
    cells.right(area, 0, &format!(" {network}"), cells.palette.tone(tone));
    cells.text(area, 1, &scene.summary(), cells.palette.plain());
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
        scene.modules.iter().filter_map(|module| module.structure.clone()).collect();
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
        // One of several suffices.
        NetworkState::Open if places.contains(", ") => {
            (Tone::Calm, format!("connected through {places}"))
        }
        NetworkState::Open => (Tone::Calm, format!("connected to {places}")),
        NetworkState::CutOff(_) => (Tone::Alarm, format!("CUT OFF: {places} does not answer")),
        NetworkState::Failed(reason) => (Tone::Alarm, format!("NO NETWORK: {}", printable(reason))),
        NetworkState::Closed => (Tone::Alarm, "NETWORK LOST, reconnecting".to_owned()),
    }
}

/// A warning that the screen is frozen or the scene outdated.
fn currency(model: &Model) -> Option<(Tone, String)> {
    if let Some(frozen) = model.frozen_for_ns() {
        return Some((Tone::Doubt, format!("FROZEN {}, f thaws", lasting(frozen))));
    }
    let age = model.picture_age_ns();
    let is_old = model.shown().number > 0 && age >= OLD_NS;
    is_old.then(|| (Tone::Alarm, format!("PICTURE IS {} OLD", lasting(age))))
}
