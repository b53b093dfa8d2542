//! What a row is about: a module or a component, of a structure.

use names::{ComponentPath, ModuleName, StructureName};
use observer::{LiveModule, Scene};
use wire::FaultTransition;

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
    pub(crate) fn of(module: &LiveModule) -> Self {
        let member = &module.picture.member;
        Self { structure: member.structure.clone(), module: member.module.clone() }
    }

    pub(crate) fn find<'a>(&self, scene: &'a Scene) -> Option<&'a LiveModule> {
        scene.modules.iter().find(|module| Self::of(module) == *self)
    }
}
