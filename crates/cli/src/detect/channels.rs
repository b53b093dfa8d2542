//! How the channels are watched: all alike, or each as in its module's configuration.

use std::path::PathBuf;

use daemon::config::load_diagnoser;
use diagnosis::ModuleSetup;
use diagnosis::detector::ChannelGroup;
use diagnosis::divergence::{DivergenceSettings, Interval};
use vocabulary::{ComponentPath, Signal};

use crate::export::RESIDUALS;
use crate::failure::Failure;

/// The channels of a module.
#[derive(Debug, Clone)]
pub(super) struct ModuleChannels {
    pub(super) setup: ModuleSetup,
    pub(super) components: Vec<ComponentPath>,
    group: ChannelGroup,
}

/// How all channels of a table are watched.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DetectionPlan {
    /// In the order of the channels.
    pub(super) groups: Vec<ChannelGroup>,
    /// The same in words.
    pub(super) words: String,
}

impl DetectionPlan {
    /// All channels alike.
    pub(super) fn alike(group: ChannelGroup) -> DetectionPlan {
        let DivergenceSettings { window, lag, interval } = group.settings;
        let interval = match interval {
            Interval::Growing => "all vectors since the start".to_owned(),
            Interval::Sliding { vectors } => format!("the last {vectors} vectors"),
        };
        let threshold = match group.channels.first() {
            Some(tuning) if tuning.threshold.is_finite() => {
                format!("threshold {}", tuning.threshold)
            }
            _ => "no threshold: nothing counts as a change".to_owned(),
        };
        let words = format!("window {window}, lag {lag}, {interval}; {threshold}");
        DetectionPlan { groups: vec![group], words }
    }

    /// Each channel as in its module's configuration.
    pub(super) fn of_modules(modules: &[ModuleChannels]) -> DetectionPlan {
        let names: Vec<_> =
            modules.iter().map(|module| format!("`{}`", module.setup.module)).collect();
        let words = format!("settings and thresholds of {}", names.join(", "));
        DetectionPlan { groups: modules.iter().map(|module| module.group.clone()).collect(), words }
    }

    /// Can anything count as a change?
    pub(super) fn has_threshold(&self) -> bool {
        let mut channels = self.groups.iter().flat_map(|group| &group.channels);
        channels.any(|tuning| tuning.threshold.is_finite())
    }
}

/// Reads the configurations of diagnosers. Of their components only those in `wanted` are kept, if that
/// is given.
///
/// # Errors
/// A configuration with mistakes, one module twice, or something wanted that none of them has.
pub(super) fn load(
    files: &[PathBuf],
    wanted: Option<&[String]>,
) -> Result<Vec<ModuleChannels>, Failure> {
    let mut modules: Vec<ModuleChannels> = Vec::new();
    for file in files {
        let setup = load_diagnoser(file)?.module_setup();
        if setup.learned.is_some() {
            let problem = "a learned module judges alone; give no other --config";
            return Err(Failure::usage(format!("{}: {problem}", file.display())));
        }
        let module = ModuleChannels::new(setup);
        if modules.iter().any(|earlier| earlier.setup.module == module.setup.module) {
            return Err(Failure::usage(format!(
                "{}: `{}` is given twice; give each module once",
                file.display(),
                module.setup.module
            )));
        }
        modules.push(module);
    }
    // Without modules any column may be wanted.
    if let Some(wanted) = wanted.filter(|_| !modules.is_empty()) {
        check_wanted(&modules, wanted)?;
        modules.iter_mut().for_each(|module| module.keep(wanted));
        modules.retain(|module| !module.components.is_empty());
    }
    Ok(modules)
}

/// The columns of the modules' residuals in a header row.
///
/// # Errors
/// In words, which is missing.
pub(super) fn columns(
    modules: &[ModuleChannels],
    header: &[String],
) -> Result<Vec<String>, String> {
    let find = |path: &ComponentPath| {
        let found = Signal::Residual.find(header, path, modules.len() == 1).cloned();
        found.ok_or_else(|| {
            let known: Vec<_> = header.iter().map(|name| format!("`{name}`")).collect();
            let (missing, known) = (Signal::Residual.column(path), known.join(", "));
            format!("missing column `{missing}`; {RESIDUALS}; the header has {known}")
        })
    };
    modules.iter().flat_map(|module| &module.components).map(find).collect()
}

fn check_wanted(modules: &[ModuleChannels], wanted: &[String]) -> Result<(), Failure> {
    let all = modules.iter().flat_map(|module| &module.components).map(ToString::to_string);
    let all: Vec<String> = all.collect();
    let Some(unknown) =
        wanted.iter().map(|name| name.trim()).find(|name| !all.iter().any(|c| c == name))
    else {
        return Ok(());
    };
    let all: Vec<_> = all.iter().map(|column| format!("`{column}`")).collect();
    Err(Failure::usage(format!(
        "no module given has a component `{unknown}`; use {}",
        all.join(", ")
    )))
}

impl ModuleChannels {
    fn new(setup: ModuleSetup) -> ModuleChannels {
        let path = |component| ComponentPath { module: setup.module.clone(), component };
        ModuleChannels {
            components: setup.components().into_iter().map(path).collect(),
            group: ChannelGroup::of_module(&setup),
            setup,
        }
    }

    /// Leaves out the components that are not wanted.
    fn keep(&mut self, wanted: &[String]) {
        let is_wanted = |path: &ComponentPath| {
            let path = path.to_string();
            wanted.iter().any(|name| name.trim() == path)
        };
        let mut kept = self.components.iter().map(is_wanted);
        self.group.channels.retain(|_| kept.next() == Some(true));
        self.components.retain(is_wanted);
    }
}
