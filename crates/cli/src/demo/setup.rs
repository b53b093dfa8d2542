//! The processes' configurations: the shipped ones or given ones, written to a temporary directory with endpoints of this
//! machine.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use daemon::config::{
    DiagnoserConfig, PlantFlags, Schedule, ScheduledFault, Speed, load_diagnoser, load_plant,
};
use settings::SettingsFile;
use tempfile::TempDir;
use toml::{Table, Value};
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
    /// The modules with a diagnoser, and the files of their configurations.
    pub(super) modules: Vec<ModuleName>,
    files: Vec<PathBuf>,
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
    /// Writes the configurations: those of a directory like that of `trusswatch new`, or the shipped ones.
    pub(super) fn set_up(
        given: Option<&Path>,
        speed: Speed,
        seed: u64,
    ) -> Result<DemoSetup, Failure> {
        let own = std::env::current_exe().map_err(|error| {
            Failure::runtime(format!("cannot locate this program's file: {error}"))
        })?;
        let beside_it = own.parent().unwrap_or(Path::new("."));
        let [plant, diagnoser] = ["trusswatch-plant", "trusswatch-diagnoser"];
        let (plant, diagnoser) = (beside(beside_it, plant)?, beside(beside_it, diagnoser)?);
        let directory = temporary_directory("trusswatch-demo-")?;
        let place = directory.path();
        let (of_plant, of_modules) = match given {
            Some(given) => of_directory(given)?,
            None => shipped(place)?,
        };
        let ports = u16::try_from(of_modules.len() + 2)
            .map_err(io::Error::other)
            .and_then(session::loopback::reserve)
            .map_err(|error| Failure::network(format!("no free port on 127.0.0.1: {error}")))?;
        let mut endpoints: Vec<String> =
            ports.map(|port| format!("tcp/127.0.0.1:{port}")).collect();
        let own = endpoints.remove(0);
        write_config(place, PLANT.path, of_plant, &endpoints[0], &[])?;
        let (mut configs, mut files) = (Vec::new(), Vec::new());
        for (index, (name, table)) in of_modules.into_iter().enumerate() {
            // Each module connects to the plant and to the modules before it.
            let (before, own) = (&endpoints[..=index], &endpoints[index + 1]);
            files.push(write_config(place, &name, table, own, before)?);
            configs.push(load_diagnoser(&files[index])?);
        }
        let timing = timing(&configs);
        let setups: Vec<_> = configs.iter().map(DiagnoserConfig::module_setup).collect();
        let acts = acts(&timing, &setups);
        write_schedule(place, &acts)?;
        check_plant(place)?;
        let flags = ["--seed", &seed.to_string(), "--speed", &speed.to_string()];
        Ok(DemoSetup {
            plant,
            diagnoser,
            flags: flags.iter().map(OsString::from).collect(),
            structure: configs[0].structure_name.clone(),
            modules: configs.iter().map(|config| config.module().clone()).collect(),
            files,
            components: setups.iter().map(|setup| setup.components().len() as u64).sum(),
            own,
            endpoints,
            timing,
            acts,
            directory,
        })
    }

    /// Starts the diagnosers.
    pub(super) fn start_diagnosers(&self, children: &mut Children) -> Result<(), Failure> {
        for (module, file) in self.modules.iter().zip(&self.files) {
            let mut arguments = running(file);
            let state = self.directory.path().join("state").join(module.as_str());
            arguments.extend(["--state-dir".into(), state.into()]);
            children.start(module.as_str(), &self.diagnoser, &arguments, self.directory.path())?;
        }
        Ok(())
    }

    /// Starts the plant.
    pub(super) fn start_plant(&self, children: &mut Children) -> Result<(), Failure> {
        let place = self.directory.path();
        let mut arguments = running(&place.join(PLANT.path));
        arguments.extend_from_slice(&self.flags);
        arguments.extend(["--schedule".into(), schedule_file(place).into()]);
        children.start(vocabulary::keys::PLANT, &self.plant, &arguments, place)
    }

    /// Removes the directory, or returns its path to keep it.
    pub(super) fn clear_away(self, keep: bool) -> Option<PathBuf> {
        keep.then(|| self.directory.keep())
    }
}

fn schedule_file(place: &Path) -> PathBuf {
    place.join("schedule.toml")
}

fn running(config: &Path) -> Vec<OsString> {
    vec!["run".into(), config.into(), "--end-with-stdin".into()]
}

/// The configurations of a plant and of its modules, each with the name of its file.
type Configurations = (Table, Vec<(String, Table)>);

/// The shipped ones; writes the files that they refer to.
fn shipped(place: &Path) -> Result<Configurations, Failure> {
    for file in OTHERS {
        file.write(place)?;
    }
    let table = |file: Shipped| -> Result<Table, Failure> {
        let unusable = |error| Failure::input(format!("the shipped `{}`: {error}", file.path));
        file.text.parse().map_err(unusable)
    };
    let modules = MODULES.map(|file| Ok((file.path.to_owned(), table(file)?)));
    Ok((table(PLANT)?, modules.into_iter().collect::<Result<_, Failure>>()?))
}

/// Those of a directory, with whole paths in place of relative ones.
fn of_directory(given: &Path) -> Result<Configurations, Failure> {
    let given = fs::canonicalize(given).map_err(|error| Failure::unreadable(given, error))?;
    let table = |name: &str| -> Result<Table, Failure> {
        let document = SettingsFile::read(&given.join(name))?;
        let mut table: Table = document.parse()?;
        for key in ["structure", "thresholds", "reference"] {
            if let Some(Value::String(path)) = table.get_mut(key) {
                *path = given.join(&*path).to_string_lossy().into_owned();
            }
        }
        Ok(table)
    };
    let plant = load_plant(&given.join(PLANT.path), &PlantFlags::default())?;
    let names = plant.structure.equipped().map(|module| format!("{}.toml", module.name));
    let modules = names.map(|name| table(&name).map(|table| (name, table)));
    Ok((table(PLANT.path)?, modules.collect::<Result<_, Failure>>()?))
}

/// Writes a configuration with these endpoints.
fn write_config(
    place: &Path,
    name: &str,
    mut table: Table,
    listen: &str,
    connect: &[String],
) -> Result<PathBuf, Failure> {
    table.insert("network".to_owned(), network(listen, connect));
    let file = place.join(name);
    fs::write(&file, table.to_string()).map_err(|error| Failure::unwritable(&file, error))?;
    Ok(file)
}

fn network(listen: &str, connect: &[String]) -> Value {
    let array =
        |endpoints: &[String]| Value::Array(endpoints.iter().cloned().map(Value::from).collect());
    let entries = [("listen", array(&[listen.to_owned()])), ("connect", array(connect))];
    Value::Table(entries.map(|(key, value)| (key.to_owned(), value)).into_iter().collect())
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
