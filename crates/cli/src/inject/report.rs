//! What the plant will do, for people and for machines.

use std::io::{self, Write};

use serde::Serialize;
use vocabulary::{ComponentPath, Injected, Injection, Step, StructureName, fault::Fault};

use crate::failure::Failure;
use crate::versioned;

#[derive(Serialize)]
struct Document<'a> {
    structure: &'a StructureName,
    component: &'a ComponentPath,
    /// `null` for a repair.
    fault: Option<Fault>,
    effective_step: Step,
}

/// Prints it on standard output.
pub(super) fn print(
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
        write!(out, "{}", versioned::line(&document)?)?;
    } else {
        let what = fault.map_or("repaired".to_owned(), |fault| fault.kind().to_string());
        writeln!(out, "{component}: {what} from step {effective_step} on")?;
    }
    Ok(out.flush()?)
}
