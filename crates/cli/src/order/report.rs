//! Outcomes of commands, for people and for machines. Failures are printed on standard error.

use std::io::{self, Write};

use observer::OrderOutcome;
use serde::Serialize;

use super::outcome::CommandOutcome;
use super::subject::Subject;
use crate::failure::Failure;
use crate::paint::{Colour, Paint};
use crate::versioned;
use vocabulary::words::done;

#[derive(Serialize)]
struct Document<'a> {
    orders: &'a [CommandOutcome],
}

/// Prints them on standard output.
pub(super) fn print(outcomes: &[CommandOutcome], json: bool) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if json {
        write!(out, "{}", versioned::text(&Document { orders: outcomes })?)?;
    } else {
        let paint = Paint::of_stdout();
        for line in outcomes.iter().filter_map(line) {
            writeln!(out, "{}", paint.in_colour(Colour::Green, &line))?;
        }
    }
    Ok(out.flush()?)
}

/// The line for a command that was obeyed.
fn line(command: &CommandOutcome) -> Option<String> {
    let OrderOutcome::Obeyed { state, sequence, .. } = &command.outcome else { return None };
    let what = done(command.order);
    let CommandOutcome { subject, by, .. } = command;
    // The state is that of one of its components.
    let now = match subject {
        Subject::Component(_) => format!("now {state}, transition {sequence}"),
        Subject::Module(_) => format!("up to transition {sequence}"),
    };
    Some(format!("{what:<12} {subject} by {by}: {now}"))
}
