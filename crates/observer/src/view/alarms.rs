//! What is urgent, and whether all is well: one judgement for every view.

use std::cmp::Reverse;

use serde::Serialize;
use vocabulary::StructureName;

use super::component::Counts;
use super::module::ModuleView;
use super::row::{StateRow, Urgency};
use super::scene::Scene;

/// Every component, and every module whose verdicts are missing or cannot be relied on; the most urgent first, and of
/// these the latest.
#[must_use]
pub fn rows(modules: &[ModuleView]) -> Vec<StateRow> {
    let of_module = |module: &ModuleView| {
        let row =
            |state| StateRow { is_covered: module.covers(state), ..StateRow::of_component(state) };
        let components: Vec<_> = module.components.iter().map(row).collect();
        module.row().into_iter().chain(components)
    };
    let mut rows: Vec<StateRow> = modules.iter().flat_map(of_module).collect();
    // Stable: rows of one time stay in the order of their names.
    rows.sort_by_key(|row| (row.urgency, row.component.is_some(), Reverse(row.since_unix_ns)));
    rows
}

/// The same without what is normal. The row of a module stands for its components of which nothing is known because of
/// it.
#[must_use]
pub fn alarms(modules: &[ModuleView]) -> Vec<StateRow> {
    let mut rows = rows(modules);
    rows.retain(|row| (row.urgency != Urgency::Normal || row.is_set_aside) && !row.is_covered);
    rows
}

/// Whether every module is one process that answers, is in service and writes its journal, and no component is faulty or
/// possibly so. An alarm that is shelved or suppressed does not count, nor that a module is not in service while it is
/// suppressed. False without any module, and where a module that is down might not be on the list.
#[must_use]
pub fn all_is_well(scene: &Scene) -> bool {
    let structures: Vec<&[ModuleView]> = scene.structures().collect();
    let only = structures.len() == 1;
    !structures.is_empty() && structures.iter().all(|modules| are_well(modules, only))
}

/// The same of the modules of one structure, which may be the only one.
fn are_well(modules: &[ModuleView], only: bool) -> bool {
    is_complete(modules, only) && !rows(modules).iter().any(|row| row.urgency.needs_attention())
}

/// A module that is down is named by the statuses of its peers, which do not pass a gateway, or by the caller who expects
/// it: a name without a structure stands for a module of the only one.
fn is_complete(modules: &[ModuleView], only: bool) -> bool {
    modules.iter().any(|module| module.status.is_some())
        || only && modules.iter().any(|module| module.expected)
}

/// How a structure is, in figures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StructureRow<'a> {
    /// None of modules that are expected and of which nothing was seen.
    pub structure: Option<&'a StructureName>,
    /// See [`all_is_well`].
    pub all_is_well: bool,
    /// Modules that are there or should be.
    #[serde(rename = "modules")]
    pub module_count: usize,
    /// Those that reported the states of their components.
    pub modules_answering: usize,
    /// Those of them that are in service.
    pub modules_in_service: usize,
    /// Their components.
    #[serde(flatten)]
    pub counts: Counts,
    /// What is not normal.
    #[serde(skip)]
    pub alarms: Vec<StateRow>,
    /// The modules.
    #[serde(skip)]
    pub modules: &'a [ModuleView],
}

impl StructureRow<'_> {
    /// The more urgent, the greater.
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
