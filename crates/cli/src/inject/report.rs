//! What the plant will do, for people and for machines.

use std::io::{self, Write};

use serde::Serialize;
use truss::fault::Fault;
use truss::ids::{ComponentPath, Step, StructureName};
use wire::{Injected, Injection};

use crate::failure::Failure;

#[derive(Serialize)]
struct Document<'a> {
    structure: &'a StructureName,
    component: &'a ComponentPath,
    /// `null` for a repair.
    fault: Option<Fault>,
    effective_step: Step,
}

/// Tells it on standard output.
pub(super) fn tell(
    structure: &StructureName,
    injection: &Injection,
    injected: &Injected,
    json: bool,
) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    let Injected { component, effective_step } = injected;
    let fault = injection.fault;
    if json {
        let document = Document { structure, component, fault, effective_step: *effective_step };
        serde_json::to_writer(&mut out, &document)?;
        writeln!(out)?;
    } else {
        let what = fault.map_or("repaired".to_owned(), |fault| fault.kind().to_string());
        writeln!(out, "{component}: {what} from step {effective_step} on")?;
    }
    Ok(out.flush()?)
}
