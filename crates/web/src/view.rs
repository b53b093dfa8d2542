//! A scene with the links that lead on from it.

use std::collections::BTreeSet;

use names::{ComponentPath, ModuleName, StructureName};
use observer::{LiveModule, Scene};

use crate::drawing::{Drawing, Shown};

/// What a page shows of a scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) drawing: Option<&'a Drawing>,
    /// Whether links have to say of which structure something is.
    several: bool,
}

impl<'a> View<'a> {
    pub(crate) fn new(scene: &'a Scene, drawing: Option<&'a Drawing>) -> Self {
        let several = structures(scene).len() > 1;
        Self { scene, drawing, several }
    }

    /// The structures that are seen. Modules that are only expected belong to none yet.
    pub(crate) fn structures(&self) -> BTreeSet<Option<&'a StructureName>> {
        structures(self.scene)
    }

    /// The modules of a structure.
    pub(crate) fn modules(
        &self,
        structure: Option<&'a StructureName>,
    ) -> impl Iterator<Item = &'a LiveModule> {
        let of = move |module: &&LiveModule| module.picture.member.structure.as_ref() == structure;
        self.scene.modules.iter().filter(of)
    }

    /// Where a component's page is.
    pub(crate) fn component(
        &self,
        structure: Option<&StructureName>,
        path: &ComponentPath,
    ) -> String {
        self.of(structure, format!("/component/{path}"))
    }

    /// Where a module's page is.
    pub(crate) fn module(&self, structure: Option<&StructureName>, module: &ModuleName) -> String {
        self.of(structure, format!("/module/{module}"))
    }

    /// What a drawing shows of a component.
    pub(crate) fn shown(&self, structure: &StructureName, path: &ComponentPath) -> Shown<'a> {
        let transition = self.scene.component(Some(structure), path);
        Shown { href: self.component(Some(structure), path), transition }
    }

    fn of(&self, structure: Option<&StructureName>, path: String) -> String {
        match structure {
            Some(structure) if self.several => format!("{path}?structure={structure}"),
            _ => path,
        }
    }
}

fn structures(scene: &Scene) -> BTreeSet<Option<&StructureName>> {
    scene.modules.iter().map(|module| module.picture.member.structure.as_ref()).collect()
}

/// A module of a structure; of any structure if none is named.
pub(crate) fn find_module<'a>(
    scene: &'a Scene,
    structure: Option<&StructureName>,
    module: &ModuleName,
) -> Option<&'a LiveModule> {
    scene.modules.iter().find(|known| {
        let member = &known.picture.member;
        member.module == *module
            && structure.is_none_or(|name| member.structure.as_ref() == Some(name))
    })
}
