//! What became of orders, for people and for machines. What went wrong is told on standard error.

use std::io::{self, IsTerminal, Write};

use serde::Serialize;
use wire::OrderKind;

use super::outcome::{Outcome, Told};
use crate::failure::Failure;
use crate::paint::{Colour, Paint};

#[derive(Serialize)]
struct Document<'a> {
    orders: &'a [Told],
}

/// Tells it on standard output.
pub(super) fn tell(told: &[Told], json: bool) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if json {
        serde_json::to_writer_pretty(&mut out, &Document { orders: told })?;
        writeln!(out)?;
    } else {
        let paint = Paint::for_terminal(io::stdout().is_terminal());
        for line in told.iter().filter_map(line) {
            writeln!(out, "{}", paint.in_colour(Colour::Green, &line))?;
        }
    }
    Ok(out.flush()?)
}

/// What is told of an order that was obeyed.
fn line(told: &Told) -> Option<String> {
    let Outcome::Obeyed { state, sequence } = &told.outcome else { return None };
    let what = match told.order {
        OrderKind::Acknowledge => "acknowledged",
        OrderKind::Reset => "reset",
    };
    let Told { component, by, .. } = told;
    Some(format!("{what:<12} {component} by {by}: now {state}, transition {sequence}"))
}
