//! Identifies the subject of a row, a page or an order.

use vocabulary::{ComponentPath, FaultTransition, ModuleName, StructureName};

/// A module; without a structure if it is only expected and its structure is not known.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ModuleId {
    /// The structure.
    pub structure: Option<StructureName>,
    /// The module.
    pub module: ModuleName,
}

/// A component of a structure.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ComponentId {
    /// The structure.
    pub structure: StructureName,
    /// The component.
    pub component: ComponentPath,
}

impl ComponentId {
    /// The component of a state.
    #[must_use]
    pub fn of(state: &FaultTransition) -> Self {
        Self { structure: state.structure.clone(), component: state.component.clone() }
    }

    /// Its module.
    #[must_use]
    pub fn module(&self) -> ModuleId {
        let (structure, module) = (Some(self.structure.clone()), self.component.module.clone());
        ModuleId { structure, module }
    }
}

/// The subject of a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RowId {
    /// A module.
    Module(ModuleId),
    /// A component.
    Component(ComponentId),
}
