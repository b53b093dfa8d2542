//! `trusswatch check`: determines the kinds of files, and checks whether they are valid.

pub(crate) mod kind;
mod zenoh_settings;

use std::io::Write;
use std::path::{Path, PathBuf};

use daemon::config::{
    PlantFlags, load_diagnoser, load_learned, load_plant, load_reference, load_schedule,
};
use diagnosis::state::Reference;
use diagnosis::thresholds::Thresholds;
use plant::PlantParameters;
use serde::Deserialize;
use settings::{ConfigError, ConfigErrors, SettingsFile};
use truss::Structure;

use crate::failure::Failure;
use crate::output;
use kind::FileKind;

/// Check configuration files and certificates without starting anything
///
/// Reports what each file is and every mistake in it and in the files that it names. Knows structures,
/// plants, diagnosers, thresholds, references, learned modules, schedules, parameters of a plant and Zenoh settings; which of these a
/// file is follows from its content. Of a directory that `trusswatch pki issue` has made, the certificate and the key are
/// checked.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Files to check
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mut out = output::stdout();
    let mut mistakes = Vec::new();
    for file in &arguments.files {
        match check(file) {
            Ok(what) => writeln!(out, "{}: valid: {what}", file.display())?,
            Err(errors) => mistakes.extend(errors.0.iter().map(ToString::to_string)),
        }
    }
    out.flush()?;
    if mistakes.is_empty() { Ok(()) } else { Err(Failure::inputs(mistakes)) }
}

/// The kind of the file, or its problems.
fn check(file: &Path) -> Result<String, ConfigErrors> {
    if file.is_dir() {
        return zenoh_settings::check_identity(file);
    }
    let text = SettingsFile::read(file)?.text;
    match FileKind::of(file, &text).map_err(|(line, problem)| mistake(file, line, problem))? {
        FileKind::Structure => structure(file, &text),
        FileKind::Plant => plant(file),
        FileKind::Diagnoser => diagnoser(file),
        FileKind::Thresholds => thresholds(file),
        FileKind::Reference => reference(file),
        FileKind::Learned => learned(file),
        FileKind::Schedule => {
            Ok(format!("schedule of {} faults", load_schedule(file)?.faults.len()))
        }
        FileKind::Notify => {
            Ok(format!("{} recipients of messages", ::notify::Notify::read(file)?.recipients.len()))
        }
        FileKind::Parameters => parameters(file),
        FileKind::Zenoh => zenoh_settings::check_settings(file),
    }
}

/// What `trusswatch new --plant` takes. Nodes that it names are those of a structure that is not known here.
fn parameters(file: &Path) -> Result<String, ConfigErrors> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct ParametersAlone {
        plant: PlantParameters,
    }
    let document = SettingsFile::read(file)?;
    let ParametersAlone { plant } = document.parse()?;
    let mut errors = ConfigErrors(Vec::new());
    for error in plant.check().err().map(|errors| errors.0).unwrap_or_default() {
        let place: Vec<&str> = ["plant"].into_iter().chain(error.parameter.split('.')).collect();
        errors.add(file, document.line(&place), &error);
    }
    document.check_numbers(&mut errors);
    errors.or("parameters of a plant, for `trusswatch new --plant`".to_owned())
}

fn mistake(file: &Path, line: Option<usize>, problem: impl ToString) -> ConfigErrors {
    ConfigErrors(vec![ConfigError { file: file.to_owned(), line, problem: problem.to_string() }])
}

fn structure(file: &Path, text: &str) -> Result<String, ConfigErrors> {
    let structure = Structure::from_toml(text).map_err(|errors| {
        let each = errors.iter().map(|error| mistake(file, error.line, &error.problem).0);
        ConfigErrors(each.flatten().collect())
    })?;
    let (name, nodes, members) = (&structure.name, structure.nodes.len(), structure.members.len());
    for part in structure.parts() {
        truss::Mechanics::assemble(&part).map_err(|error| mistake(file, None, error))?;
    }
    let modules: Vec<_> = structure.modules.iter().map(|module| module.name.as_str()).collect();
    let modules = modules.join(", ");
    Ok(format!("structure `{name}`, {nodes} nodes, {members} members, modules {modules}"))
}

fn plant(file: &Path) -> Result<String, ConfigErrors> {
    let config = load_plant(file, &PlantFlags::default())?;
    config.network.check_time()?;
    let modules: Vec<_> =
        config.structure.equipped().map(|module| module.name.to_string()).collect();
    Ok(format!(
        "plant of `{}`, modules {}, seed {}, speed {}",
        config.structure.name,
        modules.join(", "),
        config.seed,
        config.speed
    ))
}

fn diagnoser(file: &Path) -> Result<String, ConfigErrors> {
    let config = load_diagnoser(file)?;
    config.network.check_time()?;
    let (actuators, gages) = config.size();
    if config.module_setup().learned.is_some() {
        let (module, structure) = (config.module(), &config.structure_name);
        return Ok(format!(
            "diagnoser of learned module `{module}` of `{structure}`, {gages} channels"
        ));
    }
    let peers: Vec<_> = config.peers().iter().map(ToString::to_string).collect();
    Ok(format!(
        "diagnoser of module `{}` of `{}`, {actuators} actuators, {gages} gages, peers: {}",
        config.module(),
        config.structure_name,
        if peers.is_empty() { "none".to_owned() } else { peers.join(", ") }
    ))
}

/// Checks thresholds alone; whether they fit a module is checked with that module's file.
fn thresholds(file: &Path) -> Result<String, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    let read: Thresholds = document.parse()?;
    let components: Vec<_> = read.thresholds.keys().cloned().collect();
    let fitted =
        read.fit(&read.module, &components, &read.detection, None).map_err(|problems| {
            let each = problems.iter().map(|problem| {
                let place = problem.place();
                let place: Vec<&str> = place.iter().map(String::as_str).collect();
                mistake(file, document.line(&place), problem).0
            });
            ConfigErrors(each.flatten().collect())
        })?;
    let mut errors = ConfigErrors(Vec::new());
    document.check_numbers(&mut errors);
    errors.or(())?;
    Ok(format!("{} thresholds of module `{}`", fitted.len(), read.module))
}

fn learned(file: &Path) -> Result<String, ConfigErrors> {
    let module = load_learned(file)?;
    let (channels, recordings) = (module.channels.len(), module.recordings.len());
    let (sensors, hours) = (module.sensors, module.hours);
    Ok(format!(
        "learned module, {sensors} sensors, {} inputs, learnt from {recordings} recordings, {hours:.3} h",
        channels - sensors
    ))
}

/// Checks a reference alone; whether it fits a module is checked with that module's file.
fn reference(file: &Path) -> Result<String, ConfigErrors> {
    let read = load_reference(file)?;
    let problems = read.figure_problems();
    if !problems.is_empty() {
        let each = problems.iter().flat_map(|problem| mistake(file, None, problem).0);
        return Err(ConfigErrors(each.collect()));
    }
    let Reference { module, hours, long, cylinders, .. } = &*read;
    let (gages, cylinders) = (long.own_gages.len(), cylinders.len());
    Ok(format!(
        "reference of module `{module}`, {cylinders} actuators, {gages} gages, learnt from {hours:.3} h"
    ))
}
