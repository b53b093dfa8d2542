//! The exact replay of every process.

use std::collections::BTreeSet;
use std::panic::resume_unwind;
use std::thread::{self, ScopedJoinHandle};
use std::time::Instant;

use ::replay::{
    Difference, ModuleRecord, ProcessCourse, Replayed, Shortfall, courses, processes_before, replay,
};
use diagnosis::messages::Speaker;
use recording::STATE_WITHIN;
use serde::Serialize;
use vocabulary::{FaultTransition, ModuleName, RunId, Step, StructureName};

use super::reading::RecordingContents;

/// A process of a module, replayed as far as it can be.
#[derive(Default, Serialize)]
pub(super) struct ReplayedProcess {
    /// When it was started \[ns since 1970\].
    pub(super) process: u64,
    /// The run and step after which it is replayed, if not from its start: the recording has its state there.
    pub(super) after: Option<(RunId, Step)>,
    /// Version of its software; `None` if it cannot be replayed.
    pub(super) software: Option<String>,
    /// Samples used.
    pub(super) samples: u64,
    /// The verdicts as they are published, in order.
    pub(super) verdicts: Vec<FaultTransition>,
    pub(super) verdicts_same: u64,
    pub(super) divergences_same: u64,
    pub(super) identifications_same: u64,
    pub(super) verdicts_not_verified: u64,
    pub(super) divergences_not_verified: u64,
    pub(super) identifications_not_verified: u64,
    pub(super) verdicts_not_recorded: u64,
    /// None of its divergences is recorded, though there were some.
    pub(super) divergences_absent: bool,
    /// None of its identifications is recorded, though there were some.
    pub(super) identifications_absent: bool,
    pub(super) verdicts_after_recorded: u64,
    /// Verdicts that it came to before the recording began, and that are not in it.
    pub(super) verdicts_before_recorded: u64,
    /// The first difference.
    pub(super) difference: Option<Difference>,
    /// Why it is not replayed, or not to its end.
    pub(super) shortfall: Option<String>,
    /// What should be known of it.
    pub(super) notes: Vec<String>,
    /// Length of a step \[s\].
    #[serde(skip)]
    pub(super) step_s: f64,
}

/// A module, replayed.
#[derive(Serialize)]
pub(super) struct ReplayedModule {
    pub(super) structure: StructureName,
    pub(super) module: ModuleName,
    /// Recorded verdicts that no process is known of.
    pub(super) verdicts_without_process: u64,
    /// Recorded divergences that no process is known of.
    pub(super) divergences_without_process: u64,
    /// Recorded identifications that no process is known of.
    pub(super) identifications_without_process: u64,
    /// Processes that had ended before the recording began: what they decided is not in question.
    pub(super) processes_before: usize,
    pub(super) processes: Vec<ReplayedProcess>,
}

/// The whole recording, replayed.
#[derive(Serialize)]
pub(super) struct ExactReplay {
    /// The longest time of a module \[s\].
    pub(super) seconds: f64,
    /// How long all of it took \[s\].
    pub(super) took_s: f64,
    pub(super) modules: Vec<ReplayedModule>,
}

/// Replays each module on a thread of its own.
pub(super) fn run(reading: &RecordingContents, began: Instant) -> ExactReplay {
    let modules: Vec<ReplayedModule> = thread::scope(|scope| {
        let threads: Vec<_> =
            reading.records.iter().map(|record| scope.spawn(|| module(record))).collect();
        // A module must not be missing unnoticed.
        let joined =
            |thread: ScopedJoinHandle<'_, _>| thread.join().unwrap_or_else(|p| resume_unwind(p));
        threads.into_iter().map(joined).collect()
    });
    let of_module = |module: &ReplayedModule| -> f64 {
        module.replayed().map(|one| one.samples as f64 * one.step_s).sum()
    };
    let seconds = modules.iter().map(of_module).fold(0.0, f64::max);
    ExactReplay { seconds, took_s: began.elapsed().as_secs_f64(), modules }
}

fn module(record: &ModuleRecord) -> ReplayedModule {
    let courses = courses(record);
    let processes_before = processes_before(record);
    let remembered = RememberedVerdicts::of(&courses, processes_before > 0);
    let processes: Vec<ReplayedProcess> = courses
        .into_iter()
        .map(|(process, course)| {
            let replayed = course.and_then(|course| Ok((replay(record, &course)?, course)));
            match replayed {
                Ok((replayed, course)) => ReplayedProcess::of(record, course, replayed),
                Err(shortfall) => ReplayedProcess {
                    process,
                    shortfall: Some(shortfall.to_string()),
                    ..ReplayedProcess::default()
                },
            }
        })
        .collect();
    let compared = |of: fn(&ReplayedProcess) -> u64| -> u64 { processes.iter().map(of).sum() };
    let verdicts = compared(|one| one.verdicts_same + one.verdicts_not_verified);
    let divergences = compared(|one| one.divergences_same + one.divergences_not_verified);
    let identifications =
        compared(|one| one.identifications_same + one.identifications_not_verified);
    let is_own = |time, sequence| !remembered.has(time, sequence);
    let own = record.transitions.iter().filter(|t| is_own(t.time_unix_ns, t.sequence));
    let own: BTreeSet<_> = own.map(|t| (t.incarnation, t.sequence)).collect();
    let found = record.identifications.iter().filter(|i| is_own(i.time_unix_ns, i.sequence));
    let said = record.divergences.iter().filter(|d| !remembered.is_lead_in(d.time_unix_ns));
    ReplayedModule {
        structure: record.structure.clone(),
        module: record.module.clone(),
        verdicts_without_process: (own.len() as u64).saturating_sub(verdicts),
        divergences_without_process: (said.count() as u64).saturating_sub(divergences),
        identifications_without_process: (found.count() as u64).saturating_sub(identifications),
        processes_before,
        processes,
    }
}

/// The verdicts that the first process remembered, or had published before the recording has its state: they are published
/// again, and were never to be replayed. So are those of processes that had ended before the recording began.
struct RememberedVerdicts {
    before: u64,
    /// When the last of those processes had ended at the latest.
    ended_before: u64,
    sequences: BTreeSet<u64>,
    /// It is not followed from its start.
    has_lead_in: bool,
}

impl RememberedVerdicts {
    fn of(courses: &[(u64, Result<ProcessCourse, Shortfall>)], have_ended: bool) -> Self {
        let first = courses.first();
        let ended_before = first.filter(|_| have_ended).map_or(0, |(process, _)| *process);
        let course = first.and_then(|(_, course)| course.as_ref().ok());
        let latest = course.into_iter().flat_map(|course| &course.memory.latest);
        let sequences = latest.map(|transition| transition.sequence).collect();
        let before = course.map_or(0, ProcessCourse::from);
        let has_lead_in = course.is_some_and(|c| c.state.is_some());
        Self { before, ended_before, sequences, has_lead_in }
    }

    fn has(&self, time_unix_ns: u64, sequence: u64) -> bool {
        time_unix_ns < self.ended_before
            || time_unix_ns < self.before && self.sequences.contains(&sequence)
    }

    fn is_lead_in(&self, time_unix_ns: u64) -> bool {
        let since = self.before.saturating_sub(STATE_WITHIN.as_nanos() as u64);
        self.has_lead_in && (since..self.before).contains(&time_unix_ns)
    }
}

impl ReplayedProcess {
    fn of(record: &ModuleRecord, course: ProcessCourse, replayed: Replayed) -> Self {
        let speaker = Speaker::of(record.structure.clone(), record.module.clone());
        let Replayed { transitions, samples, comparison, shortfall } = replayed;
        let message =
            |of: ::replay::ReplayedTransition| speaker.transition(of.transition, of.time_unix_ns);
        Self {
            process: course.process,
            after: course.state.and_then(|state| state.position),
            software: Some(course.software),
            samples,
            verdicts: transitions.into_iter().map(message).collect(),
            verdicts_same: comparison.verdicts,
            divergences_same: comparison.divergences,
            identifications_same: comparison.identifications,
            verdicts_not_verified: comparison.verdicts_unverified,
            divergences_not_verified: comparison.divergences_unverified,
            identifications_not_verified: comparison.identifications_unverified,
            verdicts_not_recorded: comparison.verdicts_unrecorded,
            divergences_absent: comparison.divergences_absent,
            identifications_absent: comparison.identifications_absent,
            verdicts_after_recorded: comparison.verdicts_beyond,
            verdicts_before_recorded: comparison.verdicts_before,
            difference: comparison.difference,
            shortfall: shortfall.as_ref().map(Shortfall::to_string),
            notes: course.notes,
            step_s: course.setup.step_s,
        }
    }
}

impl ReplayedModule {
    /// Its processes that were replayed.
    pub(super) fn replayed(&self) -> impl Iterator<Item = &ReplayedProcess> {
        self.processes.iter().filter(|one| one.software.is_some())
    }
}

impl ExactReplay {
    /// All processes that were replayed.
    pub(super) fn replayed(&self) -> impl Iterator<Item = (&ReplayedModule, &ReplayedProcess)> {
        self.modules.iter().flat_map(|module| module.replayed().map(move |one| (module, one)))
    }

    /// A sum over all processes.
    pub(super) fn sum(&self, of: fn(&ReplayedProcess) -> u64) -> u64 {
        self.replayed().map(|(_, process)| of(process)).sum()
    }
}
