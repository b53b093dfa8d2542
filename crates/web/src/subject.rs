//! Which page is kept up to date.

use observer::Scene;
use serde::Deserialize;
use vocabulary::{ComponentPath, ModuleName, StructureName};

/// Something of a structure; of any structure if none is named.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Whose<N> {
    pub(crate) structure: Option<StructureName>,
    pub(crate) name: N,
}

/// Which page.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Subject {
    Overview,
    Events,
    Module(Whose<ModuleName>),
    Component(Whose<ComponentPath>),
}

/// The same as a request names it.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct Wanted {
    #[serde(default)]
    page: String,
    of: Option<String>,
    structure: Option<String>,
}

impl Wanted {
    /// What is wanted, if it is in the scene: nothing is done for names that are made up.
    pub(crate) fn subject(&self, scene: &Scene) -> Result<Subject, String> {
        let structure = self.structure.as_deref().map(str::parse).transpose();
        let structure: Option<StructureName> =
            structure.map_err(|error| format!("structure: {error}"))?;
        let of = self.of.as_deref().unwrap_or_default();
        match self.page.as_str() {
            "overview" => Ok(Subject::Overview),
            "events" => Ok(Subject::Events),
            "module" => {
                let name: ModuleName = of.parse().map_err(|error| format!("of: {error}"))?;
                let known = scene.module(structure.as_ref(), &name);
                known.ok_or_else(|| format!("no module `{name}` is known"))?;
                Ok(Subject::Module(Whose { structure, name }))
            }
            "component" => {
                let name: ComponentPath = of.parse().map_err(|error| format!("of: {error}"))?;
                let known = scene.component(structure.as_ref(), &name);
                known.ok_or_else(|| format!("no component `{name}` is known"))?;
                Ok(Subject::Component(Whose { structure, name }))
            }
            _ => Err("page: use `overview`, `events`, `module` or `component`".to_owned()),
        }
    }
}

impl Subject {
    /// How the script asks for it.
    pub(crate) fn parameters(&self) -> String {
        // Names need no escaping in a URL.
        let of = |page, of: &dyn std::fmt::Display, structure: &Option<StructureName>| {
            let structure =
                structure.as_ref().map_or_else(String::new, |name| format!("&structure={name}"));
            format!("page={page}&of={of}{structure}")
        };
        match self {
            Subject::Overview => "page=overview".to_owned(),
            Subject::Events => "page=events".to_owned(),
            Subject::Module(whose) => of("module", &whose.name, &whose.structure),
            Subject::Component(whose) => of("component", &whose.name, &whose.structure),
        }
    }
}
