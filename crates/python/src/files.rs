//! Configuration files, read without their processes' tables.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use diagnosis::residual::NominalHydraulics;
use diagnosis::thresholds::{MadeFor, Thresholds};
use diagnosis::{DetectionSection, Diagnoser, IsolationSection, ModuleSetup, SignalSettings};
use plant::PlantParameters;
use pyo3::prelude::*;
use serde::Deserialize;
use serde::de::IgnoredAny;
use settings::{ConfigErrors, SettingsFile};
use study::commissioning::PlantSite;
use truss::Structure;
use vocabulary::{ComponentPath, ModuleName};

use crate::arrays::value_error;
use crate::detector::Detector;

/// A diagnoser's file. The tables of its process are not read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ModuleFile {
    module: ModuleName,
    structure: PathBuf,
    thresholds: PathBuf,
    reference: Option<PathBuf>,
    #[serde(default)]
    peers: Vec<ModuleName>,
    #[serde(default = "one_millisecond")]
    step_s: f64,
    gage_noise_strain: f64,
    hydraulics: Option<NominalHydraulics>,
    #[serde(default)]
    signals: SignalSettings,
    #[serde(default)]
    detection: DetectionSection,
    #[serde(default)]
    isolation: IsolationSection,
    #[serde(default, rename = "network")]
    _network: IgnoredAny,
    #[serde(default, rename = "publish")]
    _publish: IgnoredAny,
    #[serde(default, rename = "queries")]
    _queries: IgnoredAny,
    #[serde(default, rename = "input")]
    _input: IgnoredAny,
    #[serde(default, rename = "tolerance")]
    _tolerance: IgnoredAny,
    #[serde(default, rename = "state")]
    _state: IgnoredAny,
    #[serde(default, rename = "health")]
    _health: IgnoredAny,
}

fn one_millisecond() -> f64 {
    1e-3
}

/// A plant's file. The tables of its process are not read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantDocument {
    structure: PathBuf,
    #[serde(default = "first_seed")]
    seed: u64,
    mismatch: Option<MismatchTable>,
    #[serde(default)]
    plant: PlantParameters,
    #[serde(default, rename = "speed")]
    _speed: IgnoredAny,
    #[serde(default, rename = "burst_steps")]
    _burst_steps: IgnoredAny,
    #[serde(default, rename = "blocks")]
    _blocks: IgnoredAny,
    #[serde(default, rename = "encoding")]
    _encoding: IgnoredAny,
    #[serde(default, rename = "steps")]
    _steps: IgnoredAny,
    #[serde(default, rename = "wait_for")]
    _wait_for: IgnoredAny,
    #[serde(default, rename = "schedule")]
    _schedule: IgnoredAny,
    #[serde(default, rename = "lock_step")]
    _lock_step: IgnoredAny,
    #[serde(default, rename = "tolerance")]
    _tolerance: IgnoredAny,
    #[serde(default, rename = "network")]
    _network: IgnoredAny,
    #[serde(default, rename = "health")]
    _health: IgnoredAny,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MismatchTable {
    relative: f64,
    seed: u64,
}

fn first_seed() -> u64 {
    1
}

/// A plant as its file describes it.
pub(crate) struct DescribedPlant {
    pub(crate) structure: Structure,
    pub(crate) parameters: PlantParameters,
    pub(crate) seed: u64,
    pub(crate) site: PlantSite,
}

/// A module's diagnoser as its configuration file describes it, with the files named in it: structure, thresholds and,
/// if there is one, reference. The tables of its process (network, state and others) are not used.
///
/// Parameters
/// ----------
/// file : str or path
///     The configuration, for example `configs/module1.toml`.
///
/// Raises
/// ------
/// ValueError
///     Everything that is wrong with the files, each with its line.
#[pyclass(module = "trusswatch", name = "Module", frozen)]
pub(crate) struct ConfiguredModule {
    pub(crate) setup: ModuleSetup,
}

#[pymethods]
impl ConfiguredModule {
    #[new]
    fn new(file: PathBuf) -> PyResult<Self> {
        Ok(Self { setup: load_module(&file).map_err(value_error)? })
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.setup.module.as_str()
    }

    /// Its components, actuators first: the columns of its arrays.
    #[getter]
    fn components(&self) -> Vec<String> {
        let module = &self.setup.module;
        let path = |component| ComponentPath { module: module.clone(), component }.to_string();
        self.setup.components().into_iter().map(path).collect()
    }

    /// The other modules that it asks.
    #[getter]
    fn peers(&self) -> Vec<&str> {
        self.setup.peers.iter().map(ModuleName::as_str).collect()
    }

    /// Length of a step [s].
    #[getter]
    fn step_s(&self) -> f64 {
        self.setup.step_s
    }

    /// Threshold of the divergence of each component.
    #[getter]
    fn thresholds(&self) -> Vec<f64> {
        self.setup.thresholds.clone()
    }

    /// Has it a reference of the healthy module?
    #[getter]
    fn has_reference(&self) -> bool {
        self.setup.reference.is_some()
    }

    /// The change detector of its residuals: an actuator's [N], a gage's [m], with one channel for each component. A gap
    /// of a few steps is filled, after a long one the channel is learnt anew, as the module's diagnoser does it.
    fn detector(&self) -> PyResult<Detector> {
        Detector::of(diagnosis::detector::ChannelGroup::of_module(&self.setup))
    }
}

fn load_structure(file: &Path) -> Result<Structure, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    Structure::from_toml(&document.text).map_err(|mistakes| {
        let mut errors = ConfigErrors(Vec::new());
        mistakes.iter().for_each(|mistake| errors.add(file, mistake.line, &mistake.problem));
        errors
    })
}

fn load_module(file: &Path) -> Result<ModuleSetup, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    let mut written: ModuleFile = document.parse()?;
    let is_open = |table: &'static str| {
        let document = &document;
        move |key: &str| !document.has(&[table, key])
    };
    written.detection.fit_to_step(written.step_s, is_open("detection"));
    written.isolation.fit_to_step(written.step_s, &written.detection, is_open("isolation"));
    let structure = load_structure(&document.beside(&written.structure))?;
    let thresholds_document = SettingsFile::read(&document.beside(&written.thresholds))?;
    let thresholds: Thresholds = thresholds_document.parse()?;
    let mut errors = ConfigErrors(Vec::new());
    let components: Vec<_> =
        structure.module(&written.module).map_or_else(Vec::new, |m| m.components().collect());
    let used_for = MadeFor::new(&structure, written.step_s);
    let fitted = thresholds.fit(&written.module, &components, &written.detection, Some(&used_for));
    if let Some(effects) = &thresholds.effects {
        let isolation = &mut written.isolation;
        isolation.root_ratio.get_or_insert(effects.root_ratio);
        if is_open("isolation")("effect_ms") {
            isolation.effect_ms = effects.effect_ms.max(isolation.quiet_ms);
        }
    }
    for problem in fitted.as_ref().err().into_iter().flatten() {
        let place = problem.place();
        let place: Vec<&str> = place.iter().map(String::as_str).collect();
        errors.add(&thresholds_document.file, thresholds_document.line(&place), problem);
    }
    let reference = written.reference.as_ref().map(|path| {
        let reference = SettingsFile::read(&document.beside(path))?.parse()?;
        Ok::<_, ConfigErrors>(Arc::new(reference))
    });
    let setup = ModuleSetup {
        module: written.module,
        structure,
        hydraulics: written.hydraulics,
        gage_noise_strain: written.gage_noise_strain,
        step_s: written.step_s,
        signals: written.signals,
        detection: written.detection.into(),
        isolation: written.isolation.in_steps_of(written.step_s),
        thresholds: fitted.unwrap_or_else(|_| vec![1.0; components.len()]),
        peers: written.peers,
        reference: reference.and_then(|loaded| errors.collect(loaded)),
        learned: None,
        readings: Vec::new(),
    };
    for problem in Diagnoser::new(setup.clone()).err().unwrap_or_default() {
        errors.add(file, document.line(&problem.place()), problem);
    }
    document.check_numbers(&mut errors);
    thresholds_document.check_numbers(&mut errors);
    errors.or(setup)
}

pub(crate) fn load_plant(file: &Path) -> Result<DescribedPlant, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    let written: PlantDocument = document.parse()?;
    let structure = load_structure(&document.beside(&written.structure))?;
    let (parameters, seed) = (written.plant, written.seed);
    let site = match written.mismatch {
        None => Ok(PlantSite::nominal(&structure, &parameters)),
        Some(MismatchTable { relative, seed }) => {
            PlantSite::drawn(&structure, &parameters, relative, seed)
        }
    };
    let site = site.map_err(|error| ConfigErrors::one(file, None, error))?;
    let mut errors = ConfigErrors(Vec::new());
    document.check_numbers(&mut errors);
    errors.or(DescribedPlant { structure, parameters, seed, site })
}
