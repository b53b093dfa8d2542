//! The structure that is simulated: the shipped tower with all four modules equipped, sampled at 200 Hz so that worlds are
//! cheap, calibrated and commissioned once for all seeds.

use std::time::Duration;

use diagnosis::ModuleSetup;
use plant::{Plant, PlantParameters};
use process::ProcessSettings;
use study::commissioning::{PlantSite, usual_snippets};
use study::{EffectRuns, NominalRuns, StudyError};
use truss::Structure;
use vocabulary::{Component, ComponentPath, ModuleName, Step, StructureName};

const TOWER: &str = include_str!("../../../configs/tower.toml");
const STOREYS: usize = 3;
const STEP_S: f64 = 5e-3;
/// The force control is slowed down, so that its time constant is several steps.
const SLOWER: f64 = 0.25;
/// The plant differs by so much from its description.
const MISMATCH: f64 = 0.05;
const SEED: u64 = 20_261_130;
/// Of calibration: runs, their length beyond the warm-up \[s\], and the factor on the largest divergence.
const RUNS: u64 = 12;
const RUN_S: f64 = 5.0;
const MARGIN: f64 = 10.0;
/// Of the effects of faults: runs with a fault in each component, and the factors on what is measured.
const EFFECT_RUNS: u64 = 2;
const RATIO_MARGIN: f64 = 4.0;
const TIME_MARGIN: u64 = 2;
/// Of commissioning: snippets under weather, their length \[s\], and the strokes \[N\].
const SNIPPETS: u64 = 60;
const SNIPPET_S: f64 = 12.0;
const STROKE_N: f64 = 100e3;

/// Why a world cannot be made or go on.
#[derive(Debug, thiserror::Error)]
pub enum SimulationError {
    /// Of a run of the plant.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// Of the structure.
    #[error(transparent)]
    Model(#[from] truss::ModelError),
    /// The structure or a module's setup is not valid.
    #[error("the simulated tower is not valid: {0}")]
    Setup(String),
    /// A fault does not fit the plant.
    #[error(transparent)]
    Inject(#[from] plant::InjectError),
}

/// A module that is simulated.
#[derive(Debug, Clone)]
pub(crate) struct SimulatedModule {
    pub(crate) setup: ModuleSetup,
    pub(crate) settings: ProcessSettings,
}

/// Everything that all seeds have in common.
#[derive(Debug, Clone)]
pub struct Setup {
    pub(crate) structure: Structure,
    pub(crate) name: StructureName,
    pub(crate) modules: Vec<SimulatedModule>,
    site: PlantSite,
}

impl Setup {
    /// Calibrates and commissions the tower; the same on every machine.
    ///
    /// # Errors
    /// A run of the plant cannot be made.
    pub fn tower(jobs: usize) -> Result<Self, SimulationError> {
        let structure = equipped_tower()?;
        let mut parameters = PlantParameters { step_s: STEP_S, ..PlantParameters::default() };
        parameters.hydraulics.force_gain_m3_per_s_per_n *= SLOWER;
        let mut setups = study::module_setups(&structure, &parameters)?;
        calibrate(&structure, &parameters, &mut setups, jobs)?;
        let site = PlantSite::drawn(&structure, &parameters, MISMATCH, SEED)?;
        let cylinders = setups.iter().flat_map(|setup| {
            let own = setup.components().into_iter();
            let cylinders = own.filter(|one| matches!(one, Component::Actuator(_)));
            cylinders.map(|component| ComponentPath { module: setup.module.clone(), component })
        });
        let cylinders: Vec<ComponentPath> = cylinders.collect();
        let plans = usual_snippets(&cylinders, SEED, SNIPPETS, SNIPPET_S, STROKE_N);
        let setups = site.commission(&setups, &plans, jobs, &|| {})?;
        let modules = setups.into_iter().map(SimulatedModule::of).collect();
        let name = structure.name.clone();
        Ok(Self { structure, name, modules, site })
    }

    /// The same with thresholds this many times as high.
    #[must_use]
    pub fn with_thresholds(mut self, times: f64) -> Self {
        for module in &mut self.modules {
            module.setup.thresholds.iter_mut().for_each(|threshold| *threshold *= times);
        }
        self
    }

    /// The length of a step \[ns\].
    pub(crate) fn step_ns(&self) -> u64 {
        (1e9 * STEP_S) as u64
    }

    /// The time of a step \[ms\].
    pub(crate) fn ms(&self, step: Step) -> u64 {
        step.0 * self.step_ns() / 1_000_000
    }

    /// The plant in weather of its own.
    ///
    /// # Errors
    /// The plant cannot be created.
    pub(crate) fn plant(&self, seed: u64) -> Result<Plant, SimulationError> {
        Ok(self.site.plant(seed)?)
    }

    pub(crate) fn module_names(&self) -> impl Iterator<Item = &ModuleName> {
        self.modules.iter().map(|module| &module.setup.module)
    }

    /// The length of the member that a gage is on \[m\].
    pub(crate) fn length_m(&self, gage: &ComponentPath) -> f64 {
        let module = self.structure.modules.iter().find(|module| module.name == gage.module);
        let gages = module.into_iter().flat_map(|module| &module.gages);
        let named =
            gages.into_iter().find(|one| gage.component == Component::Sensor(one.name.clone()));
        named.map_or(f64::NAN, |one| self.structure.gage_length_m(one))
    }

    pub(crate) fn components(&self) -> impl Iterator<Item = ComponentPath> {
        self.modules.iter().flat_map(|module| {
            let name = &module.setup.module;
            let components = module.setup.components().into_iter();
            components.map(|component| ComponentPath { module: name.clone(), component })
        })
    }
}

impl SimulatedModule {
    fn of(setup: ModuleSetup) -> Self {
        let settings = ProcessSettings {
            stale_after: Duration::from_millis(500),
            resync_after: Duration::from_millis(1000),
            recover_steps: 8192,
            sample_queue: 2048,
            hold: Duration::from_millis(1000),
            pause: Duration::from_millis(50),
            divergence_every_steps: 100,
            progress_every_steps: 20,
            status_every: Duration::from_millis(1000),
            thresholds: "simulation".to_owned(),
            reference: setup.reference.as_ref().map(|_| "simulation".to_owned()),
            tie_steps: setup.isolation.tie_steps,
            shuts_off_by_itself: true,
        };
        Self { setup, settings }
    }
}

/// Thresholds and settings of isolation, as `trusswatch calibrate` finds them.
fn calibrate(
    structure: &Structure,
    parameters: &PlantParameters,
    setups: &mut [ModuleSetup],
    jobs: usize,
) -> Result<(), SimulationError> {
    let warm_up = setups.iter().map(|setup| setup.detection.warm_up_vectors).max().unwrap_or(0);
    let steps = warm_up + (RUN_S / STEP_S) as u64;
    let runs = NominalRuns { first_seed: SEED, runs: RUNS, steps, mismatch: MISMATCH, jobs };
    let found = runs.calibrate(structure, parameters, setups, &|| {})?;
    for (setup, module) in setups.iter_mut().zip(&found.modules) {
        let channels = module.channels.iter();
        setup.thresholds = channels.map(|one| MARGIN * one.peaks.largest()).collect();
    }
    let (first_seed, runs) = (SEED + RUNS, EFFECT_RUNS);
    let effects = EffectRuns { first_seed, runs, mismatch: MISMATCH, jobs };
    let effects = effects.measure(structure, parameters, setups, &|| {})?;
    for setup in setups {
        let vectors = setup.detection.divergence.interval.vectors();
        let interval = vectors.map_or(warm_up, |vectors| vectors as u64);
        let steps = (TIME_MARGIN * effects.latest_steps).min(interval).max(interval / 4);
        setup.isolation.root_ratio = (RATIO_MARGIN * effects.largest_ratio).max(10.0);
        setup.isolation.effect_steps = steps.max(setup.isolation.effect_steps);
    }
    Ok(())
}

/// The tower whose modules are all equipped, each like the lowest two.
fn equipped_tower() -> Result<Structure, SimulationError> {
    let mut tables: Vec<String> = TOWER.split("[[modules]]").map(str::to_owned).collect();
    for (place, table) in tables.iter_mut().skip(1).enumerate() {
        if !table.contains("actuators") {
            table.push_str(&equipment(place * STOREYS));
        }
    }
    let text = tables.join("[[modules]]");
    Structure::from_toml(&text).map_err(|error| SimulationError::Setup(error.to_string()))
}

/// A cylinder beside each corner's column; gages on the columns of the lowest storey and on a diagonal of each face.
fn equipment(bottom: usize) -> String {
    let node = |level: usize, corner: usize| format!("L{level:02}C{}", corner % 4 + 1);
    let top = bottom + STOREYS;
    let (mut actuators, mut gages) = (String::new(), String::new());
    for corner in 0..4 {
        let number = corner + 1;
        let (from, to) = (node(bottom, corner), node(top, corner));
        actuators += &format!("{{ name = \"a{number}\", between = [\"{from}\", \"{to}\"] }},");
        let next = node(bottom + 1, corner);
        gages += &format!("{{ name = \"g{number}\", member = \"{from}-{next}\" }},");
    }
    for corner in 0..4 {
        let (from, to) = (node(bottom, corner), node(top, corner + 1));
        gages += &format!("{{ name = \"g{}\", member = \"{from}-{to}\" }},", corner + 5);
    }
    format!("actuators = [{actuators}]\ngages = [{gages}]\n\n")
}
