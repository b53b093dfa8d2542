//! How a replay is reported.

use std::fmt::Write;

use vocabulary::FaultTransition;

use super::exact::{ExactReplay, ReplayedModule, ReplayedProcess};
use crate::failure::Failure;
use crate::output;
use crate::table::table;
use vocabulary::words::{NOTHING, reason, utc};

const HEADING: [&str; 8] =
    ["time", "module", "component", "state", "onset s", "detected s", "decided s", "why"];

impl ExactReplay {
    /// What is written on standard output.
    pub(super) fn written(
        &self,
        verify: bool,
        json: bool,
        width: Option<u16>,
    ) -> Result<String, Failure> {
        if json {
            Ok(output::text(self)?)
        } else if verify {
            Ok(verification(self))
        } else {
            Ok(verdicts(self, width))
        }
    }

    /// How the command ends.
    pub(super) fn outcome(&self, verify: bool) -> Result<(), Failure> {
        let differences = self.replayed().filter_map(|(_, process)| process.difference.as_ref());
        let differences: Vec<String> = differences.map(ToString::to_string).collect();
        if verify && !differences.is_empty() {
            return Err(Failure::runtimes(differences));
        }
        let lacks: Vec<String> = shortfalls(self);
        let verified = self.sum(|one| one.verdicts_same + one.divergences_same);
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

    /// Everything that was recorded was compared.
    pub(super) fn complete(&self) -> Result<(), Failure> {
        let mut problems: Vec<String> = not_verified(self).into_iter().collect();
        problems.extend(shortfalls(self));
        let notes = self.replayed().flat_map(|(module, process)| {
            process.notes.iter().map(|note| format!("{}: {note}", started(module, process)))
        });
        problems.extend(notes);
        problems.extend(self.replayed().flat_map(|(module, process)| lacking(module, process)));
        if problems.is_empty() {
            return Ok(());
        }
        problems.insert(0, "not everything that was recorded could be compared".to_owned());
        Err(Failure::not_compared(problems))
    }
}

/// The verdicts as a table, and how fast it went.
fn verdicts(exact: &ExactReplay, width: Option<u16>) -> String {
    let mut table = table(&HEADING);
    let mut count = 0;
    for (_, process) in exact.replayed() {
        for verdict in &process.verdicts {
            table.add_row(row(verdict, process.step_s));
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

fn speed(exact: &ExactReplay) -> String {
    let (seconds, took_s) = (exact.seconds, exact.took_s);
    let modules = modules(exact.modules.len());
    let factor = seconds / took_s.max(1e-9);
    format!("{seconds:.1} s of {modules} in {took_s:.2} s: {factor:.0} times real time")
}

fn modules(count: usize) -> String {
    if count == 1 { "1 module".to_owned() } else { format!("{count} modules") }
}

/// What was verified, and what could not be.
fn verification(exact: &ExactReplay) -> String {
    let same = counted([
        exact.sum(|one| one.verdicts_same),
        exact.sum(|one| one.divergences_same),
        exact.sum(|one| one.identifications_same),
    ]);
    let differ = exact.replayed().any(|(_, process)| process.difference.is_some());
    let mut text = String::new();
    let verified = exact.modules.iter().filter(|module| module.replayed().next().is_some());
    let of = modules(verified.count());
    for line in
        same.map(|same| format!("{same} of {of}: the same")).into_iter().chain(not_verified(exact))
    {
        if !differ {
            let _ = writeln!(text, "{line}");
        }
    }
    for note in notes(exact) {
        let _ = writeln!(text, "note: {note}");
    }
    let _ = writeln!(text, "{}", speed(exact));
    text
}

/// So many verdicts, divergences and identifications, if there is any.
fn counted(counts: [u64; 3]) -> Option<String> {
    let [verdicts, divergences, identifications] = counts;
    (counts != [0; 3]).then(|| {
        format!(
            "{verdicts} verdicts, {divergences} divergences and {identifications} identifications"
        )
    })
}

/// How much was recorded and not compared.
fn not_verified(exact: &ExactReplay) -> Option<String> {
    let of_modules = |of: fn(&ReplayedModule) -> u64| exact.modules.iter().map(of).sum::<u64>();
    let counts = counted([
        of_modules(|module| module.verdicts_without_process)
            + exact.sum(|one| one.verdicts_not_verified),
        of_modules(|module| module.divergences_without_process)
            + exact.sum(|one| one.divergences_not_verified),
        of_modules(|module| module.identifications_without_process)
            + exact.sum(|one| one.identifications_not_verified),
    ]);
    counts.map(|counts| format!("{counts}: not verified"))
}

fn started(module: &ReplayedModule, process: &ReplayedProcess) -> String {
    format!("{}, started {}", module.module, utc(process.process))
}

/// Why something is not verified.
fn shortfalls(exact: &ExactReplay) -> Vec<String> {
    let mut all = Vec::new();
    for module in &exact.modules {
        let name = &module.module;
        if module.processes.is_empty() {
            all.push(format!("{name}: {}", ::replay::Shortfall::NoInputs));
        }
        for process in &module.processes {
            let shortfall = process.shortfall.as_ref();
            all.extend(shortfall.map(|why| format!("{}: {why}", started(module, process))));
        }
    }
    all
}

/// What a process published and the recording lacks.
fn lacking(module: &ReplayedModule, process: &ReplayedProcess) -> Vec<String> {
    let verdicts = process.verdicts_not_recorded;
    let mut lacking = Vec::new();
    lacking.extend((verdicts > 0).then(|| format!("{verdicts} verdicts are not")));
    lacking.extend(process.divergences_absent.then(|| "its divergences are not".to_owned()));
    let identified = process.identifications_absent;
    lacking.extend(identified.then(|| "its identifications are not".to_owned()));
    let name = started(module, process);
    lacking.iter().map(|what| format!("{name}: {what} in the recording")).collect()
}

/// What should be known besides.
fn notes(exact: &ExactReplay) -> Vec<String> {
    let mut notes = shortfalls(exact);
    for module in exact.modules.iter().filter(|module| module.processes_before > 0) {
        let ReplayedModule { module, processes_before: ended, .. } = module;
        notes.push(format!(
            "{module}: what its processes decided that had ended before the recording began ({ended}) is not compared"
        ));
    }
    for (module, process) in exact.replayed() {
        let name = started(module, process);
        notes.extend(process.notes.iter().map(|note| format!("{name}: {note}")));
        notes.extend(process.after.map(|(run, step)| {
            format!("{name}: replayed from step {step} of run {run} on, where the recording has its state")
        }));
        let own = env!("CARGO_PKG_VERSION");
        if let Some(software) = process.software.as_ref().filter(|software| *software != own) {
            notes.push(format!("{name}: it ran version {software}, this is version {own}"));
        }
        notes.extend(lacking(module, process));
        let before = process.verdicts_before_recorded;
        if before > 0 {
            notes.push(format!("{name}: {before} verdicts come before the recording began"));
        }
        let beyond = process.verdicts_after_recorded;
        if beyond > 0 {
            notes.push(format!("{name}: {beyond} verdicts come after the last one recorded"));
        }
    }
    notes
}
