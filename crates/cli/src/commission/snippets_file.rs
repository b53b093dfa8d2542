//! Snippets on disk, so that commissioning can go on later: a header, then one snippet a line.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use diagnosis::ModuleSetup;
use diagnosis::state::{Snippet, WindowMeans, residual_settings};
use serde::{Deserialize, Serialize};
use vocabulary::{Component, ModuleName};

use crate::failure::Failure;

/// Name of the file in the directory of references.
pub(super) const NAME: &str = "snippets.jsonl";
/// Version of the file.
const VERSION: u64 = 2;

/// Whose snippets the file holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SnippetsHeader {
    v: u64,
    modules: Vec<ModuleName>,
    /// Fingerprint of each module's settings that its residuals depend on.
    settings: Vec<String>,
}

impl SnippetsHeader {
    fn of(setups: &[ModuleSetup]) -> SnippetsHeader {
        SnippetsHeader {
            v: VERSION,
            modules: setups.iter().map(|setup| setup.module.clone()).collect(),
            settings: setups.iter().map(residual_settings).collect(),
        }
    }

    /// The place of each of the modules expected among those of the file.
    ///
    /// # Errors
    /// What keeps its snippets from being used.
    fn places(&self, expected: &SnippetsHeader) -> Result<Vec<usize>, String> {
        if self.v != VERSION {
            return Err(format!("its version is {}; this program reads {VERSION}", self.v));
        }
        let place_of = |module: &ModuleName| self.modules.iter().position(|name| name == module);
        let places: Option<Vec<usize>> = expected.modules.iter().map(place_of).collect();
        let places =
            places.filter(|places| places.len() == self.modules.len()).ok_or_else(|| {
                let [found, given] = [self, expected].map(|header| listed(&header.modules));
                format!("its modules are {found}, those given {given}; give the same")
            })?;
        for ((place, expected), module) in
            places.iter().zip(&expected.settings).zip(&expected.modules)
        {
            let found = self.settings.get(*place).map_or("none", String::as_str);
            if found != expected {
                return Err(format!(
                    "the settings of `{module}` (structure, hydraulics, sampling or residual) were \
                     others then (fingerprint {found}, now {expected}); commission without it"
                ));
            }
        }
        Ok(places)
    }
}

fn listed(modules: &[ModuleName]) -> String {
    let names: Vec<String> = modules.iter().map(|module| format!("`{module}`")).collect();
    names.join(", ")
}

/// Reads earlier snippets of the same modules.
///
/// # Errors
/// A file that cannot be read, is damaged, or is of other modules or settings.
pub(super) fn read(files: &[PathBuf], setups: &[ModuleSetup]) -> Result<Vec<Snippet>, Failure> {
    let mut snippets = Vec::new();
    for file in files {
        let name = file.display();
        let text = fs::read_to_string(file).map_err(|error| Failure::unreadable(file, error))?;
        let read = parse(&text, setups);
        snippets.extend(read.map_err(|problem| Failure::input(format!("{name}: {problem}")))?);
    }
    Ok(snippets)
}

fn parse(text: &str, setups: &[ModuleSetup]) -> Result<Vec<Snippet>, String> {
    let mut lines = text.lines().enumerate();
    let Some((_, first)) = lines.next() else { return Err("it is empty".to_owned()) };
    let header: SnippetsHeader = serde_json::from_str(first).map_err(|error| {
        format!("line 1: {error}; give the `{NAME}` of an earlier commissioning")
    })?;
    let places = header.places(&SnippetsHeader::of(setups))?;
    let snippet = |(place, line): (usize, &str)| {
        let read = serde_json::from_str(line).map_err(|error| error.to_string());
        let snippet = read.and_then(|snippet| in_order(snippet, &places));
        let checked = snippet.and_then(|snippet| check(&snippet, setups).map(|()| snippet));
        checked.map_err(|problem| format!("line {}: {problem}", place + 1))
    };
    lines.map(snippet).collect()
}

/// The snippet with its modules in the order of those given.
fn in_order(snippet: Snippet, places: &[usize]) -> Result<Snippet, String> {
    let Snippet { label, modules } = snippet;
    if modules.len() != places.len() {
        let (found, expected) = (modules.len(), places.len());
        return Err(format!("windows of {found} modules instead of {expected}"));
    }
    let modules = places.iter().map(|place| modules[*place].clone()).collect();
    Ok(Snippet { label, modules })
}

/// Has each module windows with its components?
fn check(snippet: &Snippet, setups: &[ModuleSetup]) -> Result<(), String> {
    for (windows, setup) in snippet.modules.iter().zip(setups) {
        let components = setup.components();
        let is_gage = |component: &&Component| matches!(component, Component::Sensor(_));
        let gages = components.iter().filter(is_gage).count();
        let fits = |window: &WindowMeans| {
            window.gages.len() == gages && window.cylinders.len() == components.len() - gages
        };
        if !windows.iter().all(fits) {
            return Err(format!("a window of `{}` has not its components", setup.module));
        }
    }
    Ok(())
}

/// Checks that none of the snippets that are to be made is among earlier ones: the same data twice would count as
/// more than they are.
pub(super) fn check_new(
    earlier: &[Snippet],
    labels: impl Iterator<Item = String>,
) -> Result<(), Failure> {
    let mut known: BTreeSet<String> = BTreeSet::new();
    for label in earlier.iter().map(|snippet| snippet.label.clone()).chain(labels) {
        if known.contains(&label) {
            return Err(Failure::usage(format!(
                "snippet `{label}` is there twice; use another `--seed`, or each recording once"
            )));
        }
        known.insert(label);
    }
    Ok(())
}

/// Writes all snippets into the directory, whole or not at all.
pub(super) fn write(
    directory: &Path,
    setups: &[ModuleSetup],
    snippets: &[Snippet],
) -> Result<(), Failure> {
    let mut text = serde_json::to_string(&SnippetsHeader::of(setups))? + "\n";
    for snippet in snippets {
        text += &serde_json::to_string(snippet)?;
        text.push('\n');
    }
    let (file, new) = (directory.join(NAME), directory.join(format!("{NAME}.new")));
    fs::write(&new, text)
        .and_then(|()| fs::rename(&new, &file))
        .map_err(|error| Failure::unwritable(&file, error))
}
