//! What a row is about: a module or a component, of a structure.

use observer::{ModuleView, Scene};
use vocabulary::{ComponentPath, FaultTransition, ModuleName, StructureName};

/// A component of a structure.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Subject {
    pub(crate) structure: StructureName,
    pub(crate) component: ComponentPath,
}

impl Subject {
    pub(crate) fn of(transition: &FaultTransition) -> Self {
        let (structure, component) = (transition.structure.clone(), transition.component.clone());
        Self { structure, component }
    }

    pub(crate) fn find<'a>(&self, scene: &'a Scene) -> Option<&'a FaultTransition> {
        scene.component(Some(&self.structure), &self.component)
    }
}

/// A module; without a structure if it was only expected and it is not clear where.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Whose {
    pub(crate) structure: Option<StructureName>,
    pub(crate) module: ModuleName,
}

impl Whose {
    pub(crate) fn of(module: &ModuleView) -> Self {
        Self { structure: module.structure.clone(), module: module.module.clone() }
    }

    pub(crate) fn find<'a>(&self, scene: &'a Scene) -> Option<&'a ModuleView> {
        scene.modules.iter().find(|module| Self::of(module) == *self)
    }
}
