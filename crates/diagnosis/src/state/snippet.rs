//! Snippets of healthy data, and the values that are learnt from them.

use serde::{Deserialize, Serialize};

use super::gaussian::SnippetValues;
use super::window::cylinder_values;
use vocabulary::{WindowLength, WindowMeans};

/// What the modules measured for a while without a break.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Snippet {
    /// Where it comes from.
    pub label: String,
    /// The windows of each module, short ones and long ones, in the order of the modules.
    pub modules: Vec<Vec<WindowMeans>>,
}

/// The windows of one length in which every channel of every module has a mean: the values of one module and its peers.
pub(super) struct SnippetData {
    snippets: Vec<usize>,
    /// Gages of all, then forces of all.
    pub(super) means: Vec<Vec<f64>>,
    /// By cylinder: [`cylinder_values`].
    pub(super) cylinders: Vec<Vec<Vec<f64>>>,
    pub(super) scatters: Vec<Vec<f64>>,
    pub(super) swings: Vec<Vec<f64>>,
}

impl SnippetData {
    /// `own` is the module's place among those of the snippets.
    pub(super) fn collect(snippets: &[Snippet], own: usize, length: WindowLength) -> Self {
        let mut data = Self {
            snippets: Vec::new(),
            means: Vec::new(),
            cylinders: Vec::new(),
            scatters: Vec::new(),
            swings: Vec::new(),
        };
        for (number, snippet) in snippets.iter().enumerate() {
            for window in snippet.modules[own].iter().filter(|window| window.length == length) {
                data.add(number, snippet, window, own);
            }
        }
        data
    }

    fn add(
        &mut self,
        number: usize,
        snippet: &Snippet,
        window: &WindowMeans,
        own: usize,
    ) -> Option<()> {
        let is_same =
            |other: &&WindowMeans| other.until == window.until && other.length == window.length;
        let others = snippet.modules.iter().enumerate().filter(|(place, _)| *place != own);
        let others: Option<Vec<_>> =
            others.map(|(_, windows)| windows.iter().find(is_same)).collect();
        let all: Vec<&WindowMeans> = std::iter::once(window).chain(others?).collect();
        let gages: Option<Vec<_>> = all.iter().flat_map(|window| window.gages.clone()).collect();
        let cylinders: Option<Vec<_>> =
            all.iter().flat_map(|window| window.cylinders.clone()).collect();
        let (gages, cylinders) = (gages?, cylinders?);
        let residuals = gages.iter().map(|gage| gage.residual_m);
        self.means.push(residuals.chain(cylinders.iter().map(|c| c.force_n)).collect());
        let own_cylinders = cylinders.iter().take(window.cylinders.len());
        self.cylinders.push(own_cylinders.map(cylinder_values).map(Vec::from).collect());
        let own_gages = || gages.iter().take(window.gages.len());
        self.scatters.push(own_gages().map(|gage| gage.scatter_m2).collect());
        self.swings.push(own_gages().map(|gage| gage.swing_m2).collect());
        self.snippets.push(number);
        Some(())
    }

    /// Snippets with at least one window.
    pub(super) fn usable_snippets(&self) -> usize {
        let mut snippets = self.snippets.clone();
        snippets.dedup();
        snippets.len()
    }

    /// So many windows' values, each with its snippet.
    pub(super) fn observations<'a>(&'a self, values: &'a [Vec<f64>]) -> Vec<SnippetValues<'a>> {
        let both = self.snippets.iter().zip(values);
        both.map(|(snippet, values)| SnippetValues { snippet: *snippet, values }).collect()
    }
}
