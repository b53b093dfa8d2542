//! One scenario in words.

use std::io::{self, Write};

use study::{Campaign, LineKind, explain};

use super::runs::unusable;
use crate::failure::Failure;
use crate::paint::{Colour, Paint};

/// Replays a scenario and prints it.
pub(super) fn print(campaign: &Campaign, number: u64) -> Result<(), Failure> {
    let explanation = explain(campaign, number).map_err(|error| unusable(&error))?;
    let paint = Paint::of_stdout();
    let mut out = io::stdout().lock();
    for line in &explanation.lines {
        match colour(line.kind) {
            Some(colour) => writeln!(out, "{}", paint.in_colour(colour, &line.to_string()))?,
            None => writeln!(out, "{line}")?,
        }
    }
    Ok(out.flush()?)
}

fn colour(kind: LineKind) -> Option<Colour> {
    match kind {
        LineKind::Fault => Some(Colour::Red),
        LineKind::Injected | LineKind::Unconfirmed => Some(Colour::Yellow),
        LineKind::Explained => Some(Colour::Green),
        LineKind::Change => Some(Colour::Cyan),
        LineKind::Watching | LineKind::Asked | LineKind::Answered | LineKind::More => {
            Some(Colour::Dim)
        }
        LineKind::Setting | LineKind::Outcome | LineKind::Because => None,
    }
}
