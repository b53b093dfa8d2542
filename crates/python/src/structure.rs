//! Several modules: their diagnosers, the plant, and the study's scenarios.

use std::path::PathBuf;

use diagnosis::messages::Speaker;
use diagnosis::{Diagnoser, Measurements, ModuleSetup};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use plant::Plant;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::Value;
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use study::{Campaign, DiagnoserGroup, RigEvent, System, TimedFault};
use vocabulary::fault::Fault;
use vocabulary::{Component, ComponentPath, ModuleName, RunId, Step};

use crate::arrays::{Count, from_json, matrix, pairs, rows, value_error};
use crate::files::{ConfiguredModule, DescribedPlant, load_plant};

/// What of a message on a transition is about its publication.
const PUBLICATION: [&str; 4] = ["incarnation", "durable", "since_unix_ns", "time_unix_ns"];
/// Nominal runs are counted from here.
const NOMINAL: u64 = 1 << 32;

/// Of actuators and of levels.
type LoadArrays = (Py<PyArray1<f64>>, Py<PyArray2<f64>>);

/// A module's signals, step by step, as they are collected.
#[derive(Default)]
struct CollectedSignals {
    demands_n: Vec<f64>,
    pressures_pa: Vec<f64>,
    elongations_m: Vec<f64>,
}

impl CollectedSignals {
    fn push(&mut self, demands_n: &[f64], pressures_pa: &[[f64; 2]], elongations_m: &[f64]) {
        self.demands_n.extend_from_slice(demands_n);
        self.pressures_pa.extend(pressures_pa.iter().flatten());
        self.elongations_m.extend_from_slice(elongations_m);
    }
}

/// The signals of modules as arrays, by module.
fn samples<'py>(
    py: Python<'py>,
    modules: &[ModuleSize],
    signals: Vec<CollectedSignals>,
) -> PyResult<Bound<'py, PyDict>> {
    let all = PyDict::new(py);
    for (ModuleSize { name, actuators, gages }, signals) in modules.iter().zip(signals) {
        let of_module = PyDict::new(py);
        of_module.set_item("demands_n", matrix(py, signals.demands_n, *actuators)?)?;
        of_module.set_item("pressures_pa", pairs(py, signals.pressures_pa, *actuators)?)?;
        of_module.set_item("elongations_m", matrix(py, signals.elongations_m, *gages)?)?;
        all.set_item(name.as_str(), of_module)?;
    }
    Ok(all)
}

/// How many actuators and gages a module has.
struct ModuleSize {
    name: ModuleName,
    actuators: usize,
    gages: usize,
}

impl ModuleSize {
    fn of(name: &ModuleName, components: &[Component]) -> Self {
        let is_actuator = |component: &&Component| matches!(component, Component::Actuator(_));
        let actuators = components.iter().filter(is_actuator).count();
        Self { name: name.clone(), actuators, gages: components.len() - actuators }
    }

    fn of_diagnosers(diagnosers: &[Diagnoser]) -> Vec<Self> {
        diagnosers.iter().map(|one| Self::of(one.module(), one.components())).collect()
    }
}

/// The components of all modules: the columns of arrays.
fn components(diagnosers: &[Diagnoser]) -> Vec<String> {
    let paths = |diagnoser: &Diagnoser| -> Vec<String> {
        let module = diagnoser.module();
        let path = |c: &Component| {
            ComponentPath { module: module.clone(), component: c.clone() }.to_string()
        };
        diagnoser.components().iter().map(path).collect()
    };
    diagnosers.iter().flat_map(paths).collect()
}

/// What diagnosers made of the steps of a block.
///
/// Arrays have the shape (steps, components), with the components of all modules in order, actuators before gages.
#[pyclass(module = "trusswatch", frozen, get_all)]
pub(crate) struct Diagnosis {
    /// Paths of the components, `module1/actuator/a1`: the columns.
    components: Vec<String>,
    /// Step of the first row.
    first_step: u64,
    /// Residuals, float64: of an actuator [N], of a gage [m].
    residual: Py<PyArray2<f64>>,
    /// Divergences, float64; NaN while undefined.
    divergence: Py<PyArray2<f64>>,
    /// Changes, a dict each: component, onset_step, step, ratio of divergence to threshold, until_step.
    changes: Py<PyAny>,
    /// Verdicts that changed, in order: the program's messages on transitions, without what is about publication.
    /// `state` is `latched` if the component is declared faulty, `explained` with `explained_by` if another one's fault
    /// explains it.
    verdicts: Py<PyAny>,
    /// Kinds and sizes of faults that were found, if that was asked for: the program's messages, the latest last.
    identifications: Py<PyAny>,
}

/// A [`Diagnosis`] in the making.
#[derive(Default)]
struct Findings {
    residual: Vec<f64>,
    divergence: Vec<f64>,
    events: Vec<RigEvent>,
}

impl Findings {
    fn take(&mut self, diagnosers: &[Diagnoser], events: Vec<RigEvent>) {
        for evidence in diagnosers.iter().flat_map(Diagnoser::evidence) {
            self.residual.push(evidence.residual);
            self.divergence.push(evidence.divergence.unwrap_or(f64::NAN));
        }
        self.events.extend(events);
    }

    fn finish(
        self,
        py: Python<'_>,
        diagnosers: &[Diagnoser],
        setups: &[ModuleSetup],
        first_step: u64,
    ) -> PyResult<Diagnosis> {
        let components = components(diagnosers);
        let speaker = |module: &ModuleName| {
            let setup = setups.iter().find(|setup| setup.module == *module);
            let structure = setup.map(|setup| setup.structure.name.clone());
            structure.map(|structure| Speaker::of(structure, module.clone()))
        };
        let (mut changes, mut verdicts, mut identifications) = (vec![], vec![], vec![]);
        for event in self.events {
            match event {
                RigEvent::Change { module, change } => {
                    let path = ComponentPath { module, component: change.component.clone() };
                    let mut document = serde_json::to_value(change).map_err(value_error)?;
                    document["component"] = path.to_string().into();
                    changes.push(document);
                }
                RigEvent::Transition { module, transition } => {
                    let message = speaker(&module).map(|one| one.transition(*transition, 0));
                    let mut document = serde_json::to_value(message).map_err(value_error)?;
                    if let Value::Object(fields) = &mut document {
                        PUBLICATION.iter().for_each(|key| drop(fields.remove(*key)));
                    }
                    verdicts.push(document);
                }
                RigEvent::Identified { module, identification } => {
                    let message =
                        speaker(&module).map(|one| one.identification(*identification, 0));
                    identifications.push(serde_json::to_value(message).map_err(value_error)?);
                }
                RigEvent::Question { .. } => {}
            }
        }
        Ok(Diagnosis {
            first_step,
            residual: matrix(py, self.residual, components.len())?,
            divergence: matrix(py, self.divergence, components.len())?,
            changes: from_json(py, &changes)?.unbind(),
            verdicts: from_json(py, &verdicts)?.unbind(),
            identifications: from_json(py, &identifications)?.unbind(),
            components,
        })
    }
}

/// The diagnosers of several modules in one process, whose queries of each other are answered at once.
///
/// Parameters
/// ----------
/// modules : list of Module
///     A peer that is not among them does not answer.
/// run : int
///     Number of the run.
/// first_step : int
///     Step of the first sample.
/// identify : bool
///     Find kind and size of faults besides, which takes milliseconds each time.
///
/// Raises
/// ------
/// ValueError
///     A module twice, or none.
#[pyclass(module = "trusswatch", name = "Diagnosers")]
pub(crate) struct ModuleGroup {
    group: DiagnoserGroup,
    setups: Vec<ModuleSetup>,
    run: RunId,
    /// Step of the next sample.
    #[pyo3(get)]
    step: u64,
}

#[pymethods]
impl ModuleGroup {
    #[new]
    #[pyo3(
        signature = (modules, *, run=Count(1), first_step=Count(0), identify=false),
        text_signature = "(modules, *, run=1, first_step=0, identify=False)"
    )]
    fn new(
        modules: Vec<PyRef<'_, ConfiguredModule>>,
        run: Count,
        first_step: Count,
        identify: bool,
    ) -> PyResult<Self> {
        let setups: Vec<ModuleSetup> = modules.iter().map(|module| module.setup.clone()).collect();
        check_modules(&setups)?;
        let mut group = DiagnoserGroup::new(setups.clone()).map_err(value_error)?;
        if identify {
            group.identify(None);
        }
        Ok(Self { group, setups, run: RunId(run.0), step: first_step.0 })
    }

    /// Paths of the components of all modules: the columns of arrays.
    #[getter]
    fn components(&self) -> Vec<String> {
        components(self.group.diagnosers())
    }

    /// The present verdict on each component.
    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let states = PyDict::new(py);
        for diagnoser in self.group.diagnosers() {
            for (component, verdict) in diagnoser.verdicts() {
                let (module, component) = (diagnoser.module().clone(), component.clone());
                let path = ComponentPath { module, component }.to_string();
                states.set_item(path, verdict.state().to_string())?;
            }
        }
        Ok(states)
    }

    /// Takes the next steps of all modules.
    ///
    /// Parameters
    /// ----------
    /// samples : mapping of modules to mappings of signals to arrays
    ///     For each module `demands_n` (steps, actuators) [N], `pressures_pa` (steps, actuators, 2) of chambers A and B
    ///     [Pa], `elongations_m` (steps, gages) [m], as `Plant.advance` gives them. NaN is missing. A signal that no
    ///     component of the module has may be left out.
    ///
    /// Returns
    /// -------
    /// Diagnosis
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     An array is missing or has another shape; then nothing was taken.
    fn push(&mut self, samples: &Bound<'_, PyAny>) -> PyResult<Diagnosis> {
        let py = samples.py();
        let sizes = ModuleSize::of_diagnosers(self.group.diagnosers());
        let mut blocks = Vec::with_capacity(sizes.len());
        let mut steps = None;
        for size in &sizes {
            let block = SampleBlock::of(samples, size)?;
            let expected = *steps.get_or_insert(block.steps);
            if block.steps != expected {
                let (name, found) = (&size.name, block.steps);
                return Err(value_error(format!(
                    "samples of `{name}` have {found} steps, those of the first module {expected}"
                )));
            }
            blocks.push(block);
        }
        let (first_step, mut findings) = (self.step, Findings::default());
        let mut sample = Measurements {
            run: self.run,
            step: Step(0),
            demands_n: Vec::new(),
            pressures_pa: Vec::new(),
            elongations_m: Vec::new(),
        };
        for row in 0..steps.unwrap_or(0) {
            sample.step = Step(self.step);
            for (place, (block, size)) in blocks.iter().zip(&sizes).enumerate() {
                block.read(row, size, &mut sample);
                self.group.take_sample(place, &sample);
            }
            self.step += 1;
            let events = self.group.take_occurrences();
            findings.take(self.group.diagnosers(), events);
        }
        findings.finish(py, self.group.diagnosers(), &self.setups, first_step)
    }
}

fn check_modules(setups: &[ModuleSetup]) -> PyResult<()> {
    if setups.is_empty() {
        return Err(value_error("no module; give at least one"));
    }
    for (place, setup) in setups.iter().enumerate() {
        if setups[..place].iter().any(|earlier| earlier.module == setup.module) {
            let module = &setup.module;
            return Err(value_error(format!("`{module}` is given twice; give each module once")));
        }
    }
    Ok(())
}

/// Samples of a module, row by row.
struct SampleBlock {
    steps: usize,
    demands_n: Vec<f64>,
    pressures_pa: Vec<f64>,
    elongations_m: Vec<f64>,
}

impl SampleBlock {
    fn of(samples: &Bound<'_, PyAny>, size: &ModuleSize) -> PyResult<Self> {
        let ModuleSize { name, actuators, gages } = size;
        let module = samples.get_item(name.as_str()).map_err(|_| {
            value_error(format!("samples of `{name}` are missing; give those of every module"))
        })?;
        let mut steps = None;
        let mut signal = |key: &str, shape: &[usize]| {
            let width: usize = shape.iter().product();
            if width == 0 {
                return Ok(Vec::new());
            }
            let what = format!("`{key}` of `{name}`");
            let array =
                module.get_item(key).map_err(|_| value_error(format!("{what} is missing")))?;
            let values = rows(&array, shape, &what)?.as_slice()?.to_vec();
            let (found, expected) =
                (values.len() / width, *steps.get_or_insert(values.len() / width));
            if found != expected {
                return Err(value_error(format!(
                    "{what} has {found} steps, an earlier signal {expected}"
                )));
            }
            Ok(values)
        };
        let demands_n = signal("demands_n", &[*actuators])?;
        let pressures_pa = signal("pressures_pa", &[*actuators, 2])?;
        let elongations_m = signal("elongations_m", &[*gages])?;
        Ok(Self { steps: steps.unwrap_or(0), demands_n, pressures_pa, elongations_m })
    }

    fn read(&self, row: usize, size: &ModuleSize, into: &mut Measurements) {
        let ModuleSize { actuators, gages, .. } = *size;
        let part = |values: &[f64], width: usize| values[row * width..][..width].to_vec();
        into.demands_n = part(&self.demands_n, actuators);
        let pressures = &self.pressures_pa[2 * row * actuators..][..2 * actuators];
        into.pressures_pa = pressures.as_chunks::<2>().0.to_vec();
        into.elongations_m = part(&self.elongations_m, gages);
    }
}

/// The simulated structure with its wind, loads, hydraulics, gages, controller and faults: the plant of
/// `trusswatch-plant run` without its process.
///
/// Parameters
/// ----------
/// file : str or path
///     Its configuration, for example `configs/plant.toml`. The tables of its process are not used.
/// seed : int, optional
///     Seed of all randomness; without it that of the file. The same seed gives the same samples.
///
/// Raises
/// ------
/// ValueError
///     Everything that is wrong with the files.
#[pyclass(module = "trusswatch", name = "Plant")]
pub(crate) struct PlantModel {
    plant: Plant,
    sizes: Vec<ModuleSize>,
    step_s: f64,
}

#[pymethods]
impl PlantModel {
    #[new]
    #[pyo3(signature = (file, *, seed=None))]
    fn new(file: PathBuf, seed: Option<Count>) -> PyResult<Self> {
        let described = load_plant(&file).map_err(value_error)?;
        let seed = seed.map_or(described.seed, |seed| seed.0);
        let plant = described.site.plant(seed).map_err(value_error)?;
        let size = |module: &truss::Module| {
            ModuleSize::of(&module.name, &module.components().collect::<Vec<_>>())
        };
        let sizes = described.structure.equipped().map(size).collect();
        Ok(Self { plant, sizes, step_s: described.parameters.step_s })
    }

    /// Length of a step [s].
    #[getter]
    fn step_s(&self) -> f64 {
        self.step_s
    }

    /// The step that is computed next.
    #[getter]
    fn step(&self) -> u64 {
        self.plant.next_step().0
    }

    /// Paths of the components that may have a fault.
    #[getter]
    fn components(&self) -> Vec<String> {
        self.plant.components().map(ToString::to_string).collect()
    }

    /// Computes so many steps.
    ///
    /// Returns
    /// -------
    /// dict
    ///     For each module `demands_n` (steps, actuators) [N], `pressures_pa` (steps, actuators, 2) of chambers A and B
    ///     [Pa], `elongations_m` (steps, gages) [m]; NaN without a signal.
    fn advance<'py>(&mut self, py: Python<'py>, steps: Count) -> PyResult<Bound<'py, PyDict>> {
        let mut signals: Vec<CollectedSignals> =
            self.sizes.iter().map(|_| CollectedSignals::default()).collect();
        for step in 0..steps.0 {
            if step % 1000 == 0 {
                py.check_signals()?;
            }
            for (signals, of) in signals.iter_mut().zip(&self.plant.advance().modules) {
                signals.push(&of.demands_n, &of.pressures_pa, &of.elongations_m);
            }
        }
        samples(py, &self.sizes, signals)
    }

    /// Injects a fault into a component from the next step on, in place of any present one.
    ///
    /// Parameters
    /// ----------
    /// component : str
    ///     Its path, `module1/sensor/g5`.
    /// fault : dict
    ///     `kind` and its parameters as in a schedule: `{"kind": "bias", "offset_m": 5e-5}`.
    fn inject(&mut self, component: &str, fault: &Bound<'_, PyAny>) -> PyResult<()> {
        let json = fault.py().import("json")?.call_method1("dumps", (fault,))?;
        let fault: Fault = serde_json::from_str(json.extract()?).map_err(value_error)?;
        self.plant.inject(&path(component)?, fault).map_err(value_error)
    }

    /// Live load of each level that can move, from the bottom up [kg].
    #[getter]
    fn live_loads_kg(&self) -> Vec<f64> {
        self.plant.conditions().live_loads_kg.clone()
    }

    /// What acts on the structure until the next step, for a structure of your own that is stepped beside the plant.
    ///
    /// Returns
    /// -------
    /// tuple of arrays
    ///     The force of each actuator in the mean of the step, pushing its ends apart, (actuators,), and the wind's on each
    ///     level that can move, from the bottom up, in x and y, shared equally by its nodes, (levels, 2) [N]. Before the
    ///     first step the loads of the equilibrium at the start.
    fn loads(&self, py: Python<'_>) -> PyResult<LoadArrays> {
        let (actuators_n, levels_n) = self.plant.loads();
        let levels_n = levels_n.into_iter().flatten().collect();
        Ok((PyArray1::from_vec(py, actuators_n).unbind(), matrix(py, levels_n, 2)?))
    }

    /// The next step measures these elongations in place of those of the plant's own structure.
    ///
    /// Parameters
    /// ----------
    /// elongations_m : array, (gages,)
    ///     Of all gages, module by module [m], without the effect of live loads' weights and of temperature.
    fn respond(&mut self, elongations_m: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        match self.plant.respond(elongations_m.as_slice()?) {
            true => Ok(()),
            false => Err(value_error("elongations_m: give one of each gage, module by module")),
        }
    }

    /// Repairs a component; no effect on a healthy one.
    fn clear(&mut self, component: &str) -> PyResult<()> {
        self.plant.clear(&path(component)?).map_err(value_error)
    }
}

fn path(component: &str) -> PyResult<ComponentPath> {
    component.parse().map_err(value_error)
}

/// The study's scenarios: runs of a plant and its diagnosers with one random fault each, and runs without any. Number and
/// seed determine a scenario: those of `trusswatch study run` and `study export` with the same arguments.
///
/// Parameters
/// ----------
/// plant : str or path
///     Configuration of the plant.
/// modules : list of Module
///     The diagnosers of its modules, in the order of the structure. References are not used, because each run has a plant
///     of its own.
/// seed : int
///     Seed of the campaign.
/// mismatch : float
///     Each plant differs from the nominal model by factors within 1 ± this value.
#[pyclass(module = "trusswatch", frozen)]
pub(crate) struct Study {
    campaign: ScenarioCampaign,
}

/// A run of the study: samples, the truth, and what the diagnosers made of it.
#[pyclass(module = "trusswatch", frozen, get_all)]
pub(crate) struct Scenario {
    /// Its number.
    number: u64,
    /// Seed of its plant, wind, loads and noise.
    seed: u64,
    /// Length of a step [s].
    step_s: f64,
    /// The fault, None in a nominal run: component, fault (kind and parameters), at (first step), until (None: it stays).
    fault: Py<PyAny>,
    /// Samples by module, as `Plant.advance` gives them.
    samples: Py<PyDict>,
    /// Is the component of this column faulty at this step? bool, (steps, components).
    faulty: Py<PyArray2<bool>>,
    /// Residuals, divergences, changes and verdicts of the diagnosers.
    diagnosis: Py<Diagnosis>,
}

#[pymethods]
impl Study {
    #[new]
    #[pyo3(
        signature = (plant, modules, *, seed=Count(1), mismatch=0.0),
        text_signature = "(plant, modules, *, seed=1, mismatch=0.0)"
    )]
    fn new(
        plant: PathBuf,
        modules: Vec<PyRef<'_, ConfiguredModule>>,
        seed: Count,
        mismatch: f64,
    ) -> PyResult<Self> {
        let described = load_plant(&plant).map_err(value_error)?;
        let DescribedPlant { structure, parameters, .. } = described;
        let setup = |module: &PyRef<'_, ConfiguredModule>| ModuleSetup {
            reference: None,
            ..module.setup.clone()
        };
        if !(0.0..=0.9).contains(&mismatch) {
            return Err(value_error(format!("mismatch is {mismatch}; use 0 to 0.9")));
        }
        let setups: Vec<ModuleSetup> = modules.iter().map(setup).collect();
        check_modules(&setups)?;
        let system = System {
            name: "own".to_owned(),
            structure,
            parameters,
            setups,
            mismatch,
            controllers: Vec::new(),
            seed: seed.0,
        };
        // What cannot be run is said at once.
        system.rig(0, Vec::new()).map_err(value_error)?;
        let ranges = ScenarioRanges::default();
        Ok(Self {
            campaign: ScenarioCampaign { system, ranges, scenarios: NOMINAL, nominal: NOMINAL },
        })
    }

    /// Runs the scenario of this number, which has one fault: number modulo seven tells its kind.
    fn scenario(&self, py: Python<'_>, number: Count) -> PyResult<Scenario> {
        self.run(py, number.0 % NOMINAL, number.0)
    }

    /// Runs the nominal run of this number, which has no fault.
    fn nominal(&self, py: Python<'_>, number: Count) -> PyResult<Scenario> {
        self.run(py, NOMINAL + number.0 % NOMINAL, number.0)
    }
}

impl Study {
    fn run(&self, py: Python<'_>, case: u64, number: u64) -> PyResult<Scenario> {
        let system = &self.campaign.system;
        let case = self.campaign.draw(case, None).map_err(value_error)?;
        let mut rig = system.rig(case.seed, case.faults.clone()).map_err(value_error)?;
        let sizes = ModuleSize::of_diagnosers(rig.diagnosers());
        let mut signals: Vec<CollectedSignals> =
            sizes.iter().map(|_| CollectedSignals::default()).collect();
        let mut findings = Findings::default();
        let columns = components(rig.diagnosers());
        let mut faulty = Vec::new();
        py.detach(|| -> Result<(), study::RigError> {
            for step in (0..case.steps).map(Step) {
                rig.step()?;
                for (signals, of) in signals.iter_mut().zip(rig.samples()) {
                    signals.push(&of.demands_n, &of.pressures_pa, &of.elongations_m);
                }
                let events = rig.take_occurrences();
                findings.take(rig.diagnosers(), events);
                let is_of = |fault: &TimedFault, column: &String| {
                    fault.at <= step && fault.component.to_string() == *column
                };
                faulty.extend(columns.iter().map(|c| case.faults.iter().any(|f| is_of(f, c))));
            }
            Ok(())
        })
        .map_err(value_error)?;
        let diagnosis = findings.finish(py, rig.diagnosers(), &system.setups, 0)?;
        Ok(Scenario {
            number,
            seed: case.seed,
            step_s: system.parameters.step_s,
            fault: from_json(py, &case.faults.first())?.unbind(),
            samples: samples(py, &sizes, signals)?.unbind(),
            faulty: matrix(py, faulty, columns.len())?,
            diagnosis: Py::new(py, diagnosis)?,
        })
    }
}
