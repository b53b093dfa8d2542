//! The picture for machines.

use std::collections::{BTreeSet, VecDeque};

use observer::{Counts, ModuleView, Scene, StructureRow, all_is_well, structures};
use serde::Serialize;
use vocabulary::{
    FaultState, FaultTransition, JournalStatus, ModuleName, ModulePhase, ModuleStatus, RunId,
    Shelving, Step, StructureName,
};

use vocabulary::words::utc;

/// The whole of it.
#[derive(Debug, Serialize)]
pub(super) struct Document<'a> {
    /// When this was seen.
    time: String,
    /// What `--exit-code` tells.
    all_is_well: bool,
    /// The most urgent first.
    structures: Vec<StructureRow<'a>>,
    modules: Vec<Module<'a>>,
    components: Vec<ComponentEntry<'a>>,
    problems: &'a VecDeque<String>,
}

#[derive(Debug, Serialize)]
struct Module<'a> {
    structure: Option<&'a StructureName>,
    module: &'a ModuleName,
    answers: bool,
    present: bool,
    /// Whether several processes run as this module.
    several_processes: bool,
    expected: bool,
    peer_of: &'a BTreeSet<ModuleName>,
    phase: Option<ModulePhase>,
    phase_reason: Option<&'a str>,
    phase_since: Option<String>,
    in_service_since_step: Option<Step>,
    run: Option<RunId>,
    step: Option<Step>,
    lag_ms: Option<f64>,
    /// By how much its clock is ahead of the publisher's, if that is why the lag is what it is \[s\].
    clock_ahead_s: Option<f64>,
    sample_age_ms: Option<f64>,
    journal: Option<&'a JournalStatus>,
    /// When its latest status was published.
    status_time: Option<String>,
    /// Its components by state.
    #[serde(flatten)]
    counts: Counts,
    not_normal: usize,
    /// If the alarms of all of them are suppressed, the suppression that ends first.
    suppressed: Option<&'a Shelving>,
}

#[derive(Debug, Serialize)]
struct ComponentEntry<'a> {
    #[serde(flatten)]
    transition: &'a FaultTransition,
    time: String,
}

/// Components that are other than normal, or whose alarm is shelved or suppressed, or all of them; modules are always all
/// there.
pub(super) fn document(scene: &Scene, all: bool) -> Document<'_> {
    let is_shown = |component: &&FaultTransition| {
        all || component.state() != FaultState::Normal || component.aside().is_some()
    };
    let entry = |transition| ComponentEntry { transition, time: time(transition) };
    Document {
        time: utc(scene.time_unix_ns),
        all_is_well: all_is_well(scene),
        structures: structures(scene),
        modules: scene.modules.iter().map(module).collect(),
        components: scene.components().filter(is_shown).map(entry).collect(),
        problems: &scene.problems,
    }
}

fn time(transition: &FaultTransition) -> String {
    utc(transition.time_unix_ns)
}

fn module(view: &ModuleView) -> Module<'_> {
    let status = view.status.as_ref();
    // A reason is given only as long as it is the reason of the present phase.
    let change = view.latest_phase_change();
    let counts = view.counts();
    Module {
        structure: view.structure.as_ref(),
        module: &view.module,
        answers: view.answers(),
        present: view.present,
        several_processes: view.has_several_processes(),
        expected: view.expected,
        peer_of: &view.peer_of,
        phase: view.phase(),
        phase_reason: change.map(|change| change.reason.as_str()),
        phase_since: change.map(|change| utc(change.time_unix_ns)),
        in_service_since_step: status.and_then(|status| status.in_service_since_step),
        run: status.and_then(|status| status.run),
        step: status.and_then(|status| status.step),
        lag_ms: status.and_then(|status| status.lag_ms),
        clock_ahead_s: status.and_then(ModuleStatus::clock_difference).map(|d| d.ahead_s),
        sample_age_ms: status.and_then(|status| status.sample_age_ms),
        journal: status.map(|status| &status.journal),
        status_time: status.map(|status| utc(status.time_unix_ns)),
        counts,
        not_normal: counts.total() - counts.normal,
        suppressed: view.suppression(),
    }
}
