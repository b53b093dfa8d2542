//! Columns that are the channels of a module, to be watched as the module's diagnoser does.

use std::path::{Path, PathBuf};

use daemon::config::load_diagnoser;
use diagnosis::ModuleSetup;
use vocabulary::{ComponentPath, ModuleName};

use super::plan::{Group, Plan, Tuning};
use crate::failure::Failure;

/// A module's channels and how they are watched.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Module {
    pub(super) name: ModuleName,
    /// Names of the columns, one for each channel of the group.
    pub(super) columns: Vec<String>,
    pub(super) group: Group,
}

/// Reads the configurations of diagnosers. Of their components only those in `wanted` are kept, if that
/// is given.
///
/// # Errors
/// A configuration with mistakes, one module twice, or something wanted that none of them has.
pub(super) fn load(files: &[PathBuf], wanted: Option<&[String]>) -> Result<Vec<Module>, Failure> {
    let mut modules: Vec<Module> = Vec::new();
    for file in files {
        let module = read(file)?;
        if modules.iter().any(|earlier| earlier.name == module.name) {
            return Err(Failure::usage(format!(
                "{}: `{}` was given before; give each module once",
                file.display(),
                module.name
            )));
        }
        modules.push(module);
    }
    // Without modules any column may be wanted.
    if let Some(wanted) = wanted.filter(|_| !modules.is_empty()) {
        check_wanted(&modules, wanted)?;
        modules.iter_mut().for_each(|module| module.keep(wanted));
        modules.retain(|module| !module.columns.is_empty());
    }
    Ok(modules)
}

/// Each channel as in its module's configuration.
pub(super) fn plan(modules: Vec<Module>) -> Plan {
    let names: Vec<_> = modules.iter().map(|module| format!("`{}`", module.name)).collect();
    let words = format!("settings and thresholds of {}", names.join(", "));
    Plan { groups: modules.into_iter().map(|module| module.group).collect(), words }
}

fn read(file: &Path) -> Result<Module, Failure> {
    let config = load_diagnoser(file)
        .map_err(|errors| Failure::inputs(errors.0.iter().map(ToString::to_string).collect()))?;
    Ok(Module::new(&config.module_setup()))
}

fn check_wanted(modules: &[Module], wanted: &[String]) -> Result<(), Failure> {
    let known = |name: &str| modules.iter().any(|module| module.columns.iter().any(|c| c == name));
    let Some(unknown) = wanted.iter().map(|name| name.trim()).find(|name| !known(name)) else {
        return Ok(());
    };
    let all = modules.iter().flat_map(|module| &module.columns);
    let all: Vec<_> = all.map(|column| format!("`{column}`")).collect();
    Err(Failure::usage(format!(
        "no module given has a component `{unknown}`; use {}",
        all.join(", ")
    )))
}

impl Module {
    fn new(setup: &ModuleSetup) -> Module {
        let module = setup.structure.module(&setup.module);
        let components = module.into_iter().flat_map(|module| module.components());
        let path = |component| ComponentPath { module: setup.module.clone(), component };
        let tunings = setup.prior_scatters().into_iter().zip(&setup.thresholds);
        let channels = tunings
            .map(|(prior_scatter, &threshold)| Tuning { prior_scatter, threshold })
            .collect();
        Module {
            name: setup.module.clone(),
            columns: components.map(|component| path(component).to_string()).collect(),
            group: Group {
                settings: setup.detection.divergence,
                warm_up: setup.detection.warm_up_vectors,
                quiet_steps: setup.isolation.quiet_steps,
                channels,
            },
        }
    }

    /// Leaves out the columns that are not wanted.
    fn keep(&mut self, wanted: &[String]) {
        let is_wanted = |column: &String| wanted.iter().any(|name| name.trim() == column);
        let mut kept = self.columns.iter().map(is_wanted);
        self.group.channels.retain(|_| kept.next() == Some(true));
        self.columns.retain(is_wanted);
    }
}
