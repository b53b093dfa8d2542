//! The journals for machines.

use observer::{Contradiction, HistoryGap, JournalEntry, Journals, ModuleHistory};
use serde::Serialize;
use vocabulary::{FaultTransition, Identification, ModuleName, StructureName};

use super::reading::{Reading, Silent};
use vocabulary::words::utc;

/// The whole of it.
#[derive(Debug, Serialize)]
pub(super) struct Document<'a> {
    modules: Vec<Module<'a>>,
    transitions: Vec<Transition<'a>>,
    identifications: Vec<IdentificationEntry<'a>>,
    silent: Vec<SilentModule<'a>>,
    gaps: Vec<ModuleGap<'a>>,
    /// Modules whose times contradict the order of their steps.
    clocks: Vec<Clocks<'a>>,
}

#[derive(Debug, Serialize)]
struct Module<'a> {
    structure: &'a StructureName,
    module: &'a ModuleName,
    /// The lowest sequence number that the journal still holds.
    first_sequence: Option<u64>,
    next_sequence: Option<u64>,
    /// How many were read, wanted or not.
    read: usize,
    /// Why reading ended before the journal did.
    broken_off: Option<String>,
}

#[derive(Debug, Serialize)]
struct Transition<'a> {
    #[serde(flatten)]
    transition: &'a FaultTransition,
    time: String,
}

#[derive(Debug, Serialize)]
struct IdentificationEntry<'a> {
    #[serde(flatten)]
    identification: &'a Identification,
    time: String,
}

#[derive(Debug, Serialize)]
struct SilentModule<'a> {
    structure: Option<&'a StructureName>,
    module: &'a ModuleName,
    reason: &'a str,
}

#[derive(Debug, Serialize)]
struct ModuleGap<'a> {
    structure: &'a StructureName,
    module: &'a ModuleName,
    from_sequence: u64,
    to_sequence: u64,
}

#[derive(Debug, Serialize)]
struct Clocks<'a> {
    structure: &'a StructureName,
    ahead: &'a ModuleName,
    behind: &'a ModuleName,
    at_least_s: u64,
}

pub(super) fn document<'a>(reading: &'a Reading, journals: &Journals<'a>) -> Document<'a> {
    let (mut transitions, mut identifications) = (Vec::new(), Vec::new());
    for entry in &journals.entries {
        match *entry {
            JournalEntry::Transition(transition) => {
                transitions.push(Transition { transition, time: utc(transition.time_unix_ns) });
            }
            JournalEntry::Identification(identification) => {
                let time = utc(identification.time_unix_ns);
                identifications.push(IdentificationEntry { identification, time });
            }
        }
    }
    Document {
        modules: reading.histories.iter().map(module).collect(),
        transitions,
        identifications,
        silent: reading.silent.iter().map(silent).collect(),
        gaps: reading.histories.iter().flat_map(gaps).collect(),
        clocks: journals.contradictions.iter().map(clocks).collect(),
    }
}

fn module(history: &ModuleHistory) -> Module<'_> {
    Module {
        structure: &history.structure,
        module: &history.module,
        first_sequence: history.first_sequence,
        next_sequence: history.next_sequence,
        read: history.transitions.len(),
        broken_off: history.broken_off.as_ref().map(ToString::to_string),
    }
}

fn silent(silent: &Silent) -> SilentModule<'_> {
    let Silent { structure, module, reason } = silent;
    SilentModule { structure: structure.as_ref(), module, reason }
}

fn clocks<'a>(found: &Contradiction<'a>) -> Clocks<'a> {
    let Contradiction { structure, ahead, behind, by } = *found;
    Clocks { structure, ahead, behind, at_least_s: by.as_secs() }
}

fn gaps(history: &ModuleHistory) -> impl Iterator<Item = ModuleGap<'_>> {
    let ModuleHistory { structure, module, .. } = history;
    history.gaps().into_iter().map(move |HistoryGap { from, to }| ModuleGap {
        structure,
        module,
        from_sequence: from,
        to_sequence: to,
    })
}
