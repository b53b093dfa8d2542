//! The exact replay of every process.

use std::thread;
use std::time::Instant;

use ::replay::{ModuleRecord, Replayed, Shortfall, courses, replay};
use vocabulary::{ModuleName, StructureName};

use super::reading::RecordingContents;

/// A process of a module, replayed.
pub(super) struct Process {
    /// When it was started \[ns since 1970\].
    pub(super) process: u64,
    /// Version of its software.
    pub(super) software: String,
    /// Length of a step \[s\].
    pub(super) step_s: f64,
    /// What should be known of it.
    pub(super) notes: Vec<String>,
    /// What came of it.
    pub(super) replayed: Replayed,
}

/// A module, replayed.
pub(super) struct Module {
    pub(super) structure: StructureName,
    pub(super) module: ModuleName,
    /// Each process, or why it cannot be replayed.
    pub(super) processes: Vec<Result<Process, (u64, Shortfall)>>,
    /// Recorded verdicts and divergences that no process is known of.
    pub(super) unverified: (u64, u64),
}

/// The whole recording, replayed.
pub(super) struct Exact {
    pub(super) modules: Vec<Module>,
    /// How long all of it took \[s\].
    pub(super) took_s: f64,
}

/// Replays each module on a thread of its own.
pub(super) fn run(reading: &RecordingContents, began: Instant) -> Exact {
    let modules = thread::scope(|scope| {
        let threads: Vec<_> =
            reading.records.iter().map(|record| scope.spawn(|| module(record))).collect();
        threads.into_iter().filter_map(|thread| thread.join().ok()).collect()
    });
    Exact { modules, took_s: began.elapsed().as_secs_f64() }
}

fn module(record: &ModuleRecord) -> Module {
    let processes: Vec<_> = courses(record)
        .into_iter()
        .map(|(process, course)| {
            let course = course.map_err(|shortfall| (process, shortfall))?;
            let replayed = replay(record, &course).map_err(|shortfall| (process, shortfall))?;
            Ok(Process {
                process,
                software: course.software,
                step_s: course.setup.step_s,
                notes: course.notes,
                replayed,
            })
        })
        .collect();
    let compared = |of: fn(&Replayed) -> u64| -> u64 {
        processes.iter().flatten().map(|process| of(&process.replayed)).sum()
    };
    let verdicts = compared(|r| r.comparison.verdicts + r.comparison.verdicts_unverified);
    let divergences = compared(|r| r.comparison.divergences + r.comparison.divergences_unverified);
    let judged = record.transitions.iter().filter(|t| t.run.is_some() && t.sequence > 0);
    let unverified = (
        (judged.count() as u64).saturating_sub(verdicts),
        (record.divergences.len() as u64).saturating_sub(divergences),
    );
    let (structure, module) = (record.structure.clone(), record.module.clone());
    Module { structure, module, processes, unverified }
}

impl Module {
    fn replayed(&self) -> impl Iterator<Item = &Process> {
        self.processes.iter().flatten()
    }
}

impl Exact {
    /// All processes that were replayed.
    pub(super) fn replayed(&self) -> impl Iterator<Item = (&Module, &Process)> {
        self.modules.iter().flat_map(|module| module.replayed().map(move |one| (module, one)))
    }

    /// A sum over all processes.
    pub(super) fn sum(&self, of: fn(&Replayed) -> u64) -> u64 {
        self.replayed().map(|(_, process)| of(&process.replayed)).sum()
    }

    /// The longest time of a module \[s\].
    pub(super) fn seconds(&self) -> f64 {
        let of_module = |module: &Module| -> f64 {
            module.replayed().map(|one| one.replayed.samples as f64 * one.step_s).sum()
        };
        self.modules.iter().map(of_module).fold(0.0, f64::max)
    }
}
