//! Ranks alarms by urgency and decides whether all is well, the same way for every view.

use std::cmp::Reverse;

use serde::Serialize;
use vocabulary::StructureName;

use super::component::Counts;
use super::module::ModuleView;
use super::row::{StateRow, Urgency};
use super::scene::Scene;

/// Every component, and every module whose verdicts are missing or unreliable, sorted by urgency, then latest first.
#[must_use]
pub fn rows(modules: &[ModuleView]) -> Vec<StateRow> {
    let of_module = |module: &ModuleView| {
        let row =
            |state| StateRow { is_covered: module.covers(state), ..StateRow::of_component(state) };
        let components: Vec<_> = module.components.iter().map(row).collect();
        module.row().into_iter().chain(components)
    };
    let mut rows: Vec<StateRow> = modules.iter().flat_map(of_module).collect();
    // A stable sort keeps rows of the same time in the order of their names.
    rows.sort_by_key(|row| (row.urgency, row.component.is_some(), Reverse(row.since_unix_ns)));
    rows
}

/// Like [`rows`], without normal ones. The row of a module replaces the rows of components that are unknown because of
/// that module.
#[must_use]
pub fn alarms(modules: &[ModuleView]) -> Vec<StateRow> {
    let mut rows = rows(modules);
    rows.retain(|row| (row.urgency != Urgency::Normal || row.is_set_aside) && !row.is_covered);
    rows
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
