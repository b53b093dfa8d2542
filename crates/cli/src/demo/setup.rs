//! The processes' configurations: the shipped ones, written to a temporary directory with endpoints of this machine.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use daemon::config::{
    DiagnoserConfig, PlantFlags, Schedule, ScheduledFault, Speed, load_diagnoser, load_plant,
};
use tempfile::TempDir;
use toml::Table;
use vocabulary::{ModuleName, StructureName};

use super::children::Children;
use super::story::{Act, DemoTiming, acts};
use crate::failure::Failure;
use crate::shipped::{MODULES, OTHERS, PLANT, Shipped, temporary_directory};

/// The processes' configurations, and data derived from them.
pub(super) struct DemoSetup {
    plant: PathBuf,
    diagnoser: PathBuf,
    directory: TempDir,
    flags: Vec<OsString>,
    /// Name of the structure.
    pub(super) structure: StructureName,
    /// The modules with a diagnoser.
    pub(super) modules: Vec<ModuleName>,
    /// The number of components.
    pub(super) components: u64,
    /// The endpoint of the parent.
    pub(super) own: String,
    /// The endpoints of the processes.
    pub(super) endpoints: Vec<String>,
    /// Durations in steps.
    pub(super) timing: DemoTiming,
    /// The stories.
    pub(super) acts: Vec<Act>,
}

impl DemoSetup {
    /// Writes the configurations.
    pub(super) fn set_up(speed: Speed, seed: u64) -> Result<DemoSetup, Failure> {
        let own = std::env::current_exe().map_err(|error| {
            Failure::runtime(format!("cannot locate this program's file: {error}"))
        })?;
        let beside_it = own.parent().unwrap_or(Path::new("."));
        let [plant, diagnoser] = ["trusswatch-plant", "trusswatch-diagnoser"];
        let (plant, diagnoser) = (beside(beside_it, plant)?, beside(beside_it, diagnoser)?);
        let directory = temporary_directory("trusswatch-demo-")?;
        let no_port = |error| Failure::network(format!("no free port on 127.0.0.1: {error}"));
        let [own, at_plant, first, second] = session::loopback::endpoints().map_err(no_port)?;
        let endpoints = vec![at_plant, first, second];
        let place = directory.path();
        for file in OTHERS {
            file.write(place)?;
        }
        write_config(place, PLANT, &endpoints[0], &[])?;
        let mut configs = Vec::new();
        for (index, module) in MODULES.into_iter().enumerate() {
            // Each module connects to the plant and to the modules before it.
            let (before, own) = (&endpoints[..=index], &endpoints[index + 1]);
            let file = write_config(place, module, own, before)?;
            configs.push(load_diagnoser(&file)?);
        }
        let timing = timing(&configs);
        let acts = acts(&timing).map_err(|error| Failure::runtime(error.to_string()))?;
        write_schedule(place, &acts)?;
        check_plant(place)?;
        let flags = ["--seed", &seed.to_string(), "--speed", &speed.to_string()];
        Ok(DemoSetup {
            plant,
            diagnoser,
            flags: flags.iter().map(OsString::from).collect(),
            structure: configs[0].structure_name.clone(),
            modules: configs.iter().map(|config| config.module().clone()).collect(),
            components: configs.iter().map(components).sum(),
            own,
            endpoints,
            timing,
            acts,
            directory,
        })
    }

    /// Starts the diagnosers.
    pub(super) fn start_diagnosers(&self, children: &mut Children) -> Result<(), Failure> {
        for (module, config) in self.modules.iter().zip(MODULES) {
            let mut arguments = self.running(config.path);
            let state = self.directory.path().join("state").join(module.as_str());
            arguments.extend(["--state-dir".into(), state.into()]);
            children.start(module.as_str(), &self.diagnoser, &arguments, self.directory.path())?;
        }
        Ok(())
    }

    /// Starts the plant.
    pub(super) fn start_plant(&self, children: &mut Children) -> Result<(), Failure> {
        let place = self.directory.path();
        let mut arguments = self.running(PLANT.path);
        arguments.extend_from_slice(&self.flags);
        arguments.extend(["--schedule".into(), schedule_file(place).into()]);
        children.start(vocabulary::keys::PLANT, &self.plant, &arguments, place)
    }

    fn running(&self, config: &str) -> Vec<OsString> {
        vec!["run".into(), self.directory.path().join(config).into(), "--end-with-stdin".into()]
    }

    /// Removes the directory, or returns its path to keep it.
    pub(super) fn clear_away(self, keep: bool) -> Option<PathBuf> {
        keep.then(|| self.directory.keep())
    }
}

fn schedule_file(place: &Path) -> PathBuf {
    place.join("schedule.toml")
}

/// Writes a shipped configuration with different endpoints.
fn write_config(
    place: &Path,
    shipped: Shipped,
    listen: &str,
    connect: &[String],
) -> Result<PathBuf, Failure> {
    let unusable = |error| Failure::input(format!("the shipped `{}`: {error}", shipped.path));
    let mut table: Table = shipped.text.parse().map_err(unusable)?;
    table.insert("network".to_owned(), network(listen, connect));
    shipped.write_as(place, &table.to_string())
}

fn network(listen: &str, connect: &[String]) -> toml::Value {
    let array = |endpoints: &[String]| {
        toml::Value::Array(endpoints.iter().cloned().map(toml::Value::from).collect())
    };
    let entries = [("listen", array(&[listen.to_owned()])), ("connect", array(connect))];
    toml::Value::Table(entries.map(|(key, value)| (key.to_owned(), value)).into_iter().collect())
}

fn write_schedule(place: &Path, acts: &[Act]) -> Result<(), Failure> {
    let faults = acts.iter().map(|act| ScheduledFault {
        at_step: act.injected,
        until_step: Some(act.repaired),
        component: act.component.clone(),
        fault: act.fault,
    });
    let schedule = Schedule { faults: faults.collect() };
    let text = toml::to_string(&schedule)
        .map_err(|error| Failure::runtime(format!("cannot write the schedule: {error}")))?;
    let file = schedule_file(place);
    fs::write(&file, text).map_err(|error| Failure::unwritable(&file, error))
}

fn check_plant(place: &Path) -> Result<(), Failure> {
    let flags = PlantFlags { schedule: Some(schedule_file(place)), ..PlantFlags::default() };
    load_plant(&place.join(PLANT.path), &flags)?;
    Ok(())
}

fn components(config: &DiagnoserConfig) -> u64 {
    config.module_setup().components().len() as u64
}

/// The longest of each duration among the modules.
fn timing(configs: &[DiagnoserConfig]) -> DemoTiming {
    let mut timing = DemoTiming { step_s: 1e-3, warm_up: 0, effects: 0, interval: 0 };
    for setup in configs.iter().map(DiagnoserConfig::module_setup) {
        let divergence = setup.detection.divergence;
        let vectors = divergence.interval.vectors().unwrap_or_default() as u64;
        timing.step_s = setup.step_s;
        timing.warm_up =
            timing.warm_up.max(setup.detection.warm_up_vectors + divergence.window as u64);
        timing.effects = timing.effects.max(setup.isolation.effect_steps);
        timing.interval = timing.interval.max(vectors);
    }
    timing
}

fn beside(directory: &Path, name: &str) -> Result<PathBuf, Failure> {
    let program = directory.join(name);
    if program.is_file() {
        return Ok(program);
    }
    Err(Failure::runtime(format!(
        "`{name}` is not beside this program in {}; build it with `cargo build --release -p daemon`",
        directory.display()
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_missing_is_named_with_the_way_to_build_it() {
        let empty = tempfile::tempdir().unwrap();
        let failure = beside(empty.path(), "trusswatch-plant").unwrap_err();
        let text = format!("{failure:?}");
        assert!(text.contains("trusswatch-plant") && text.contains("cargo build"), "{text}");
    }
}
