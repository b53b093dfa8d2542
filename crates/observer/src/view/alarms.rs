//! Ranks alarms by urgency, brings together what belongs to one incident, and decides whether all is well, the same way for every view.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use serde::Serialize;
use vocabulary::words::{Tone, printable};
use vocabulary::{
    ComponentPath, Condition, FaultState, FaultTransition, ModuleName, Obstacle, StructureName,
};

use super::component::{Counts, explained_by};
use super::module::ModuleView;
use super::row::{Belonging, RowGroup, StateRow, Urgency};
use super::scene::Scene;

/// Every component, and every module whose verdicts are missing or unreliable, sorted by urgency, then latest first. The
/// row of a fault names what belongs to the same incident.
#[must_use]
pub fn rows(modules: &[ModuleView]) -> Vec<StateRow> {
    let structures = modules.chunk_by(|a, b| a.structure == b.structure);
    let mut rows: Vec<StateRow> = structures.flat_map(rows_of_structure).collect();
    // A stable sort keeps rows of the same time in the order of their names.
    rows.sort_by_key(|row| (row.urgency, row.component.is_some(), Reverse(row.since_unix_ns)));
    rows
}

fn rows_of_structure(modules: &[ModuleView]) -> Vec<StateRow> {
    let incidents = Incidents::of(modules);
    let of_module = |module: &ModuleView| {
        let row = |state: &FaultTransition| StateRow {
            is_covered: module.covers(state) || incidents.covered.contains(&state.component),
            groups: incidents.groups_of(&IncidentRoot::Component(&state.component)),
            ..StateRow::of_component(state)
        };
        let components: Vec<_> = module.components.iter().map(row).collect();
        incidents.row_of(module).into_iter().chain(components)
    };
    modules.iter().flat_map(of_module).collect()
}

/// One row per incident: [`rows`] without normal components and without rows that another row covers. A fault's row covers
/// its effects, components that cannot be compared since then, and other candidates. A module's row covers the components
/// that are unknown because of it.
#[must_use]
pub fn alarms(modules: &[ModuleView]) -> Vec<StateRow> {
    let mut rows = rows(modules);
    rows.retain(|row| (row.urgency != Urgency::Normal || row.is_set_aside) && !row.is_covered);
    rows
}

/// The subject of an incident.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum IncidentRoot<'a> {
    Module(&'a ModuleName),
    Component(&'a ComponentPath),
}

/// What belongs together in a structure.
#[derive(Debug, Default)]
struct Incidents<'a> {
    groups: BTreeMap<(IncidentRoot<'a>, Belonging), Vec<&'a ComponentPath>>,
    /// Components whose row another one replaces.
    covered: BTreeSet<&'a ComponentPath>,
    /// Since when a module's components cannot be compared \[ns since 1970\].
    since_unix_ns: BTreeMap<&'a ModuleName, u64>,
}

impl<'a> Incidents<'a> {
    fn of(modules: &'a [ModuleView]) -> Self {
        let all = || modules.iter().flat_map(|module| &module.components);
        let states: BTreeMap<_, _> = all().map(|state| (&state.component, state)).collect();
        let faults: Vec<_> =
            all().filter(|state| state.state().is_fault() && state.aside().is_none()).collect();
        let mut incidents = Self::default();
        for module in modules {
            for state in module.components.iter().filter(|state| !module.covers(state)) {
                incidents.sort(state, &states, &faults);
            }
        }
        incidents
    }

    fn sort(
        &mut self,
        state: &'a FaultTransition,
        states: &BTreeMap<&'a ComponentPath, &'a FaultTransition>,
        faults: &[&'a FaultTransition],
    ) {
        if let Some(root) = root(state, states) {
            self.add(IncidentRoot::Component(&root.component), Belonging::Effects, state);
            return;
        }
        if state.state() != FaultState::Unknown || state.aside().is_some() {
            return;
        }
        match &state.condition {
            Some(Condition::OneOf { components, .. }) => {
                // The likeliest stands for all.
                let likeliest = components.first().filter(|first| **first != state.component);
                let likeliest = likeliest.and_then(|first| states.get(first));
                let same = likeliest.filter(|first| {
                    first.state() == FaultState::Unknown && first.condition == state.condition
                });
                if let Some(first) = same {
                    self.add(
                        IncidentRoot::Component(&first.component),
                        Belonging::Candidates,
                        state,
                    );
                }
            }
            Some(Condition::CannotTell { obstacle }) if *obstacle != Obstacle::NoSignal => {
                let reason = printable(&obstacle.to_string());
                let since = state.unknown.as_ref().map_or(0, |unknown| unknown.since_unix_ns);
                let before = faults.iter().filter(|fault| fault.since_unix_ns <= since);
                let fault = before.max_by_key(|fault| fault.since_unix_ns);
                let belonging = Belonging::NotComparable { reason };
                if let Some(fault) = fault {
                    self.add(IncidentRoot::Component(&fault.component), belonging, state);
                } else {
                    self.add(IncidentRoot::Module(&state.module), belonging, state);
                    let known = self.since_unix_ns.entry(&state.module).or_insert(since);
                    *known = since.min(*known);
                }
            }
            _ => {}
        }
    }

    fn add(&mut self, subject: IncidentRoot<'a>, belonging: Belonging, state: &'a FaultTransition) {
        self.groups.entry((subject, belonging)).or_default().push(&state.component);
        self.covered.insert(&state.component);
    }

    fn groups_of(&self, subject: &IncidentRoot<'_>) -> Vec<RowGroup> {
        let own = self.groups.iter().filter(|((of, _), _)| of == subject);
        own.map(|((_, belonging), components)| RowGroup {
            belonging: belonging.clone(),
            components: components.iter().copied().cloned().collect(),
        })
        .collect()
    }

    /// The row of a module: of one that is in service, if its components cannot be compared and no fault is known since when
    /// they cannot.
    fn row_of(&self, module: &ModuleView) -> Option<StateRow> {
        let groups = self.groups_of(&IncidentRoot::Module(&module.module));
        let row = module.row();
        if groups.is_empty() {
            return row;
        }
        let since_unix_ns = self.since_unix_ns.get(&module.module).copied();
        let mut row = row.unwrap_or_else(|| StateRow {
            since_unix_ns: since_unix_ns.filter(|since| *since > 0),
            ..module.row_of(Urgency::Unknown, Tone::Doubt)
        });
        row.groups.extend(groups);
        Some(row)
    }
}

/// The fault that explains a component's change, over several others if need be.
fn root<'a>(
    state: &FaultTransition,
    states: &BTreeMap<&'a ComponentPath, &'a FaultTransition>,
) -> Option<&'a FaultTransition> {
    let mut by = *states.get(explained_by(state)?)?;
    // A circle would be as long as there are components.
    for _ in 0..states.len() {
        if by.state().is_fault() {
            return Some(by);
        }
        by = states.get(explained_by(by)?)?;
    }
    None
}

/// How many of these rows need attention: the number of alarms, in every view.
#[must_use]
pub fn attention(rows: &[StateRow]) -> usize {
    rows.iter().filter(|row| row.urgency.needs_attention()).count()
}

/// Whether every module is a single process that answers, is in service and writes its journal, and no component is
/// faulty or possibly faulty. Shelved and suppressed alarms are ignored; a suppressed module may be out of service.
/// False without any module, and if the list might lack a module that is down.
#[must_use]
pub fn all_is_well(scene: &Scene) -> bool {
    let structures: Vec<&[ModuleView]> = scene.structures().collect();
    let only = structures.len() == 1;
    !structures.is_empty() && structures.iter().all(|modules| are_well(modules, only))
}

/// The same for the modules of one structure; `only` if it is the only structure.
fn are_well(modules: &[ModuleView], only: bool) -> bool {
    is_complete(modules, only) && attention(&rows(modules)) == 0
}

/// Whether the list includes modules that are down. Those are known from the statuses of their peers, which do not pass
/// a gateway, or from the caller's list of expected modules, whose names apply to the only structure.
fn is_complete(modules: &[ModuleView], only: bool) -> bool {
    modules.iter().any(|module| module.status.is_some())
        || only && modules.iter().any(|module| module.expected)
}

/// Summary figures of a structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StructureRow<'a> {
    /// `None` for expected modules that have not been seen.
    pub structure: Option<&'a StructureName>,
    /// See [`all_is_well`].
    pub all_is_well: bool,
    /// Modules that are running or should be.
    #[serde(rename = "modules")]
    pub module_count: usize,
    /// Modules that reported the states of their components.
    pub modules_answering: usize,
    /// Modules, among those answering, that are in service.
    pub modules_in_service: usize,
    /// Their components.
    #[serde(flatten)]
    pub counts: Counts,
    /// The rows that are not normal.
    #[serde(skip)]
    pub alarms: Vec<StateRow>,
    /// The modules.
    #[serde(skip)]
    pub modules: &'a [ModuleView],
}

impl StructureRow<'_> {
    /// Sort key, greater if more urgent.
    fn urgency(&self) -> impl Ord + use<> {
        let of = |urgency| self.alarms.iter().filter(|row| row.urgency == urgency).count();
        let doubtful = of(Urgency::Unconfirmed) + of(Urgency::Unknown);
        let [latched, unreliable, acknowledged] =
            [Urgency::Latched, Urgency::Unreliable, Urgency::Acknowledged].map(of);
        (!self.all_is_well, latched, unreliable, doubtful, acknowledged)
    }
}

/// Each structure, the most urgent first.
#[must_use]
pub fn structures(scene: &Scene) -> Vec<StructureRow<'_>> {
    let only = scene.structures().count() == 1;
    let row = |modules| StructureRow {
        structure: <[ModuleView]>::first(modules).and_then(|module| module.structure.as_ref()),
        all_is_well: are_well(modules, only),
        module_count: modules.len(),
        modules_answering: modules.iter().filter(|module| module.answers()).count(),
        modules_in_service: modules.iter().filter(|module| module.is_in_service()).count(),
        counts: Counts::of(modules.iter().flat_map(|module| &module.components)),
        alarms: alarms(modules),
        modules,
    };
    let mut rows: Vec<StructureRow<'_>> = scene.structures().map(row).collect();
    rows.sort_by_key(|row| Reverse(row.urgency()));
    rows
}
