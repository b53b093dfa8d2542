//! What the plant is doing, for people and for machines.

use std::io::{self, Write};

use serde::Serialize;
use vocabulary::{ComponentPath, Step, Stroke, StrokeBegun, StructureName};

use crate::failure::Failure;
use crate::versioned;
use vocabulary::words::force;

#[derive(Serialize)]
struct Document<'a> {
    structure: &'a StructureName,
    component: &'a ComponentPath,
    force_n: f64,
    duration_s: f64,
    largest_strain: f64,
    first_step: Step,
    last_step: Step,
}

/// Prints it on standard output.
pub(super) fn print(
    structure: &StructureName,
    stroke: &Stroke,
    begun: &StrokeBegun,
    json: bool,
) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    let Stroke { force_n, duration_s, largest_strain, .. } = *stroke;
    let StrokeBegun { ref component, first_step, last_step } = *begun;
    if json {
        let document = Document {
            structure,
            component,
            force_n,
            duration_s,
            largest_strain,
            first_step,
            last_step,
        };
        write!(out, "{}", versioned::line(&document)?)?;
    } else {
        let size = force(force_n);
        writeln!(out, "{component}: stroke of ±{size} from step {first_step} to step {last_step}")?;
    }
    Ok(out.flush()?)
}
