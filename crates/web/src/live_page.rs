//! Identifies a page that is kept up to date.

use observer::trend::TrendSpan;
use observer::{ComponentId, ModuleId, Scene};
use serde::Deserialize;
use vocabulary::{ComponentPath, ModuleName, StructureName};

use crate::component::margins::words_of;

/// A page that is kept up to date.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum LivePage {
    Overview,
    Wall,
    Events,
    Module(ModuleId),
    Component(ComponentId),
}

/// Query parameters. If several structures are shown, pages of modules and components name the structure; the script
/// also names the page.
#[derive(Debug, Default, Deserialize)]
pub(crate) struct PageParameters {
    #[serde(default)]
    page: String,
    of: Option<String>,
    structure: Option<String>,
    /// Of a module's page: the span of its trends.
    trend: Option<String>,
}

impl PageParameters {
    /// The structure named in the parameters.
    pub(crate) fn structure(&self) -> Result<Option<StructureName>, String> {
        let parsed = self.structure.as_deref().map(str::parse).transpose();
        parsed.map_err(|error: vocabulary::NameError| format!("structure: {error}"))
    }

    /// The span of the trends, a day unless another is named.
    pub(crate) fn trend(&self) -> TrendSpan {
        let is_named = |span: &TrendSpan| self.trend.as_deref() == Some(words_of(*span).0);
        TrendSpan::ALL.into_iter().find(is_named).unwrap_or(TrendSpan::Day)
    }

    /// The page, if its subject is in the scene, so that invented names cause no work.
    pub(crate) fn page(&self, scene: &Scene) -> Result<LivePage, String> {
        let structure = self.structure()?;
        let of = self.of.as_deref().unwrap_or_default();
        match self.page.as_str() {
            "overview" => Ok(LivePage::Overview),
            "wall" => Ok(LivePage::Wall),
            "events" => Ok(LivePage::Events),
            "module" => {
                let name: ModuleName = of.parse().map_err(|error| format!("of: {error}"))?;
                let known = scene.module(structure.as_ref(), &name);
                let known = known.ok_or_else(|| format!("no module `{name}` is known"))?;
                Ok(LivePage::Module(known.id()))
            }
            "component" => {
                let name: ComponentPath = of.parse().map_err(|error| format!("of: {error}"))?;
                let known = scene.component(structure.as_ref(), &name);
                let known = known.ok_or_else(|| format!("no component `{name}` is known"))?;
                Ok(LivePage::Component(ComponentId::of(known)))
            }
            _ => Err("page: use `overview`, `wall`, `events`, `module` or `component`".to_owned()),
        }
    }
}

impl LivePage {
    /// The query parameters that the script sends.
    pub(crate) fn parameters(&self) -> String {
        // Names consist of characters that need no escaping in a URL.
        match self {
            LivePage::Overview => "page=overview".to_owned(),
            LivePage::Wall => "page=wall".to_owned(),
            LivePage::Events => "page=events".to_owned(),
            LivePage::Module(ModuleId { structure: None, module }) => {
                format!("page=module&of={module}")
            }
            LivePage::Module(ModuleId { structure: Some(structure), module }) => {
                format!("page=module&of={module}&structure={structure}")
            }
            LivePage::Component(ComponentId { structure, component }) => {
                format!("page=component&of={component}&structure={structure}")
            }
        }
    }
}
