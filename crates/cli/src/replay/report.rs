//! How a replay is reported.

use std::fmt::Write;

use ::replay::ReplayedTransition;
use diagnosis::messages::Speaker;
use serde::Serialize;
use vocabulary::FaultTransition;

use super::exact::{Exact, Module, Process};
use crate::failure::Failure;
use crate::output;
use crate::table::table;
use vocabulary::words::{NOTHING, reason, utc};

const HEADING: [&str; 8] =
    ["time", "module", "component", "state", "onset s", "detected s", "decided s", "why"];

impl Exact {
    /// What is written on standard output.
    pub(super) fn written(
        &self,
        verify: bool,
        json: bool,
        width: Option<u16>,
    ) -> Result<String, Failure> {
        if json {
            Ok(document(self)?)
        } else if verify {
            Ok(verification(self))
        } else {
            Ok(verdicts(self, width))
        }
    }

    /// How the command ends.
    pub(super) fn outcome(&self, verify: bool) -> Result<(), Failure> {
        let differences =
            self.replayed().filter_map(|(_, p)| p.replayed.comparison.difference.as_ref());
        let differences: Vec<String> = differences.map(ToString::to_string).collect();
        if verify && !differences.is_empty() {
            return Err(Failure::runtimes(differences));
        }
        let lacks: Vec<String> = shortfalls(self);
        let verified = self.sum(|r| r.comparison.verdicts + r.comparison.divergences);
        if verify && verified == 0 {
            let mut problems = vec!["nothing can be verified".to_owned()];
            problems.extend(lacks);
            return Err(Failure::inputs(problems));
        }
        if self.replayed().next().is_none() {
            return Err(Failure::inputs(lacks));
        }
        Ok(())
    }
}

/// The verdicts as a table, and how fast it went.
fn verdicts(exact: &Exact, width: Option<u16>) -> String {
    let mut table = table(&HEADING);
    let mut count = 0;
    for (module, process) in exact.replayed() {
        for verdict in &process.replayed.transitions {
            table.add_row(row(&message(module, verdict), process.step_s));
            count += 1;
        }
    }
    table.align_right([4, 5, 6]);
    table.break_times(0);
    table.stack(&[&[0], &[1], &[2], &[3], &[4, 5, 6], &[7]]);
    let mut text = String::new();
    // Writing to a string does not fail.
    if count == 0 {
        text.push_str("no verdicts\n");
    } else {
        let _ = writeln!(text, "{}", table.text(width));
    }
    for note in notes(exact) {
        let _ = writeln!(text, "note: {note}");
    }
    let _ = writeln!(text, "{}", speed(exact));
    text
}

/// A verdict as it is published.
fn message(module: &Module, verdict: &ReplayedTransition) -> FaultTransition {
    let speaker = Speaker::of(module.structure.clone(), module.module.clone());
    speaker.transition(verdict.transition.clone(), verdict.time_unix_ns)
}

fn row(message: &FaultTransition, step_s: f64) -> [String; 8] {
    let seconds = |step: Option<vocabulary::Step>| {
        step.map_or_else(|| NOTHING.to_owned(), |step| format!("{:.3}", step.0 as f64 * step_s))
    };
    let why = reason(message);
    [
        utc(message.time_unix_ns),
        message.module.to_string(),
        message.component.component.to_string(),
        message.state().to_string(),
        seconds(message.onset_step),
        seconds(message.detection_step),
        seconds(message.decided_step),
        if why.is_empty() { NOTHING.to_owned() } else { why },
    ]
}

fn speed(exact: &Exact) -> String {
    let (seconds, took_s) = (exact.seconds(), exact.took_s);
    let modules = modules(exact.modules.len());
    let factor = seconds / took_s.max(1e-9);
    format!("{seconds:.1} s of {modules} in {took_s:.2} s: {factor:.0} times real time")
}

fn modules(count: usize) -> String {
    if count == 1 { "1 module".to_owned() } else { format!("{count} modules") }
}

/// What was verified, and what could not be.
fn verification(exact: &Exact) -> String {
    let verdicts = exact.sum(|r| r.comparison.verdicts);
    let divergences = exact.sum(|r| r.comparison.divergences);
    let differ = exact.replayed().any(|(_, p)| p.replayed.comparison.difference.is_some());
    let mut text = String::new();
    let verified = exact.modules.iter().filter(|module| module.processes.iter().any(Result::is_ok));
    let of = modules(verified.count());
    if !differ && verdicts + divergences > 0 {
        let _ =
            writeln!(text, "{verdicts} verdicts and {divergences} divergences of {of}: the same");
    }
    let unverified = exact.modules.iter().map(|module| module.unverified);
    let (verdicts, divergences) = unverified.fold((0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let verdicts = verdicts + exact.sum(|r| r.comparison.verdicts_unverified);
    let divergences = divergences + exact.sum(|r| r.comparison.divergences_unverified);
    if !differ && verdicts + divergences > 0 {
        let _ = writeln!(text, "{verdicts} verdicts and {divergences} divergences: not verified");
    }
    for note in notes(exact) {
        let _ = writeln!(text, "note: {note}");
    }
    let _ = writeln!(text, "{}", speed(exact));
    text
}

/// Why something is not verified.
fn shortfalls(exact: &Exact) -> Vec<String> {
    let mut all = Vec::new();
    for module in &exact.modules {
        let name = &module.module;
        if module.processes.is_empty() {
            all.push(format!("{name}: {}", ::replay::Shortfall::NoInputs));
        }
        for process in &module.processes {
            let (process, shortfall) = match process {
                Ok(one) => (one.process, one.replayed.shortfall.as_ref()),
                Err((process, shortfall)) => (*process, Some(shortfall)),
            };
            let since = utc(process);
            all.extend(shortfall.map(|why| format!("{name}, started {since}: {why}")));
        }
    }
    all
}

/// What should be known besides.
fn notes(exact: &Exact) -> Vec<String> {
    let mut notes = shortfalls(exact);
    for (module, process) in exact.replayed() {
        let name = format!("{}, started {}", module.module, utc(process.process));
        notes.extend(process.notes.iter().map(|note| format!("{name}: {note}")));
        let own = env!("CARGO_PKG_VERSION");
        if process.software != own {
            let software = &process.software;
            notes.push(format!("{name}: it ran version {software}, this is version {own}"));
        }
        let comparison = &process.replayed.comparison;
        let unrecorded = comparison.verdicts_unrecorded;
        if unrecorded > 0 {
            notes.push(format!("{name}: {unrecorded} verdicts are not in the recording"));
        }
        let beyond = comparison.verdicts_beyond;
        if beyond > 0 {
            notes.push(format!("{name}: {beyond} verdicts come after the last one recorded"));
        }
    }
    notes
}

#[derive(Serialize)]
struct Document {
    seconds: f64,
    took_s: f64,
    modules: Vec<ModuleDocument>,
}

#[derive(Serialize)]
struct ModuleDocument {
    structure: String,
    module: String,
    verdicts_without_process: u64,
    divergences_without_process: u64,
    processes: Vec<ProcessDocument>,
}

#[derive(Default, Serialize)]
struct ProcessDocument {
    process: u64,
    software: Option<String>,
    samples: u64,
    verdicts: Vec<FaultTransition>,
    verdicts_same: u64,
    divergences_same: u64,
    verdicts_not_verified: u64,
    divergences_not_verified: u64,
    verdicts_not_recorded: u64,
    verdicts_after_recorded: u64,
    difference: Option<DifferenceDocument>,
    shortfall: Option<String>,
    notes: Vec<String>,
}

#[derive(Serialize)]
struct DifferenceDocument {
    run: u64,
    step: u64,
    component: String,
    field: String,
    recorded: String,
    replayed: String,
}

/// The same for machines.
fn document(exact: &Exact) -> Result<String, serde_json::Error> {
    let of_module = |module: &Module| ModuleDocument {
        structure: module.structure.to_string(),
        module: module.module.to_string(),
        verdicts_without_process: module.unverified.0,
        divergences_without_process: module.unverified.1,
        processes: module.processes.iter().map(|one| of_process(module, one)).collect(),
    };
    output::text(&Document {
        seconds: exact.seconds(),
        took_s: exact.took_s,
        modules: exact.modules.iter().map(of_module).collect(),
    })
}

fn of_process(
    module: &Module,
    process: &Result<Process, (u64, ::replay::Shortfall)>,
) -> ProcessDocument {
    let one = match process {
        Ok(one) => one,
        Err((process, shortfall)) => {
            let shortfall = Some(shortfall.to_string());
            return ProcessDocument { process: *process, shortfall, ..ProcessDocument::default() };
        }
    };
    let comparison = &one.replayed.comparison;
    let difference = comparison.difference.as_ref().map(|difference| DifferenceDocument {
        run: difference.run.0,
        step: difference.step.0,
        component: difference.component.to_string(),
        field: difference.field.clone(),
        recorded: difference.recorded.clone(),
        replayed: difference.replayed.clone(),
    });
    ProcessDocument {
        process: one.process,
        software: Some(one.software.clone()),
        samples: one.replayed.samples,
        verdicts: one.replayed.transitions.iter().map(|v| message(module, v)).collect(),
        verdicts_same: comparison.verdicts,
        divergences_same: comparison.divergences,
        verdicts_not_verified: comparison.verdicts_unverified,
        divergences_not_verified: comparison.divergences_unverified,
        verdicts_not_recorded: comparison.verdicts_unrecorded,
        verdicts_after_recorded: comparison.verdicts_beyond,
        difference,
        shortfall: one.replayed.shortfall.as_ref().map(ToString::to_string),
        notes: one.notes.clone(),
    }
}
