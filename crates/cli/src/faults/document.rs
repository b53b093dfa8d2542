//! The picture for machines.

use std::collections::BTreeSet;

use names::{ModuleName, RunId, Step, StructureName};
use observer::{ModulePicture, Picture};
use serde::Serialize;
use wire::{FaultState, FaultTransition, JournalStatus, ModulePhase, Shelving};

use super::check::all_is_well;
use super::roll_up::{RollUp, by_urgency};
use shell::clock::unix_ns;
use wording::utc;

/// The whole of it.
#[derive(Debug, Serialize)]
pub(super) struct Document<'a> {
    /// When this was seen.
    time: String,
    /// What `--exit-code` tells.
    all_is_well: bool,
    /// The most urgent first.
    structures: Vec<RollUp<'a>>,
    modules: Vec<Module<'a>>,
    components: Vec<ComponentEntry<'a>>,
    problems: &'a [String],
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
    /// Components whose state it reported, by state.
    normal: usize,
    /// Those of the normal ones that agree with their reference.
    verified: usize,
    unknown: usize,
    not_normal: usize,
    /// Those of any state whose alarm is set aside.
    set_aside: usize,
    /// If the alarms of all of them are suppressed, the suppression that ends first.
    suppressed: Option<&'a Shelving>,
}

#[derive(Debug, Serialize)]
struct ComponentEntry<'a> {
    #[serde(flatten)]
    transition: &'a FaultTransition,
    time: String,
}

/// Components that are other than normal or set aside, or all of them; modules are always all there.
pub(super) fn document(picture: &Picture, all: bool) -> Document<'_> {
    let components = picture.modules.iter().flat_map(|module| &module.components);
    let is_shown = |component: &&FaultTransition| {
        all || component.state() != FaultState::Normal || component.aside().is_some()
    };
    let shown = components.filter(is_shown);
    Document {
        time: utc(unix_ns()),
        all_is_well: all_is_well(picture),
        structures: by_urgency(picture),
        modules: picture.modules.iter().map(module).collect(),
        components: shown.map(component).collect(),
        problems: &picture.problems,
    }
}

fn component(transition: &FaultTransition) -> ComponentEntry<'_> {
    ComponentEntry { transition, time: utc(transition.time_unix_ns) }
}

fn module(picture: &ModulePicture) -> Module<'_> {
    let member = &picture.member;
    let status = member.status.as_ref();
    // A reason is given only as long as it is the reason of the present phase.
    let change = member.phase_change.as_ref().filter(|c| Some(c.phase) == member.phase());
    let normal = picture.count(FaultState::Normal);
    Module {
        structure: member.structure.as_ref(),
        module: &member.module,
        answers: picture.answers(),
        present: member.present,
        several_processes: picture.has_several_processes(),
        expected: member.expected,
        peer_of: &member.peer_of,
        phase: member.phase(),
        phase_reason: change.map(|change| change.reason.as_str()),
        phase_since: change.map(|change| utc(change.time_unix_ns)),
        in_service_since_step: status.and_then(|status| status.in_service_since_step),
        run: status.and_then(|status| status.run),
        step: status.and_then(|status| status.step),
        lag_ms: status.and_then(|status| status.lag_ms),
        clock_ahead_s: status.and_then(wire::ModuleStatus::clock_difference).map(|d| d.ahead_s),
        sample_age_ms: status.and_then(|status| status.sample_age_ms),
        journal: status.map(|status| &status.journal),
        status_time: status.map(|status| utc(status.time_unix_ns)),
        normal,
        verified: picture.verified(),
        unknown: picture.count(FaultState::Unknown),
        not_normal: picture.components.len() - normal,
        set_aside: picture.set_aside(),
        suppressed: picture.suppression(),
    }
}
