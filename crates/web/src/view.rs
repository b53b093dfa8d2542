//! A scene with links to its pages.

use observer::{ModuleView, Scene};
use vocabulary::{ComponentPath, ModuleName, StructureName};

/// The part of a scene that a page shows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinkedScene<'a> {
    pub(crate) scene: &'a Scene,
    /// Whether links must name the structure.
    pub(crate) several: bool,
}

impl<'a> LinkedScene<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Self {
        Self { scene, several: scene.structures().count() > 1 }
    }

    /// The modules of each structure. Modules that are only expected belong to no structure yet.
    pub(crate) fn structures(
        &self,
    ) -> impl Iterator<Item = (Option<&'a StructureName>, &'a [ModuleView])> {
        let named = |modules: &'a [ModuleView]| {
            (modules.first().and_then(|module| module.structure.as_ref()), modules)
        };
        self.scene.structures().map(named)
    }

    /// The link to a component's page.
    pub(crate) fn component(
        &self,
        structure: Option<&StructureName>,
        path: &ComponentPath,
    ) -> String {
        self.link(structure, format!("/component/{path}"))
    }

    /// The link to a module's page.
    pub(crate) fn module(&self, structure: Option<&StructureName>, module: &ModuleName) -> String {
        self.link(structure, format!("/module/{module}"))
    }

    fn link(&self, structure: Option<&StructureName>, path: String) -> String {
        match structure {
            Some(structure) if self.several => format!("{path}?structure={structure}"),
            _ => path,
        }
    }
}
