//! A structure with its plant and its diagnosers, as described, and the plants drawn from that description.

use std::fmt;
use std::ops::Range;

use diagnosis::residual::NominalHydraulics;
use diagnosis::{DetectionSettings, IsolationSettings, ModuleSetup, SignalSettings};
use plant::{HydraulicParameters, PlantParameters};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use truss::{Member, ModelError, Module, Structure};
use vocabulary::{Component, ComponentPath, ModuleName, RunId};

use crate::calibration::plant;
use crate::commissioning::{PlantSite, SnippetPlan, usual_snippets};
use crate::error::StudyError;
use crate::rig::{Rig, TimedFault};

/// Random streams of plants, and of their changes in service.
const FIRST_PLANT_STREAM: u64 = 7 << 60;
const SOFTENED_STREAM: u64 = 12 << 60;
/// The commissioning of each plant: snippets under its weather in addition to two strokes of each cylinder, at least
/// this many, plus so many more than the values of a reference; their duration, and the force of the strokes.
const LEAST_WEATHER_SNIPPETS: u64 = 40;
const MORE_THAN_VALUES: u64 = 12;
const SNIPPET_S: f64 = 12.0;
const STROKE_N: f64 = 100e3;
/// Seeds of the plants that are asked how strong cylinders have to be.
const PROBED_PLANTS: Range<u64> = 3_000_000..3_000_016;

/// The tuning of a controller: rules of the diagnosis must not depend on the demands of one controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControllerTuning {
    /// The tuning in the plant's parameters.
    Shipped,
    /// Ten times the weight of the effort, and four times the noise assumed for gages: demands hardly move.
    Gentle,
    /// A tenth of the effort's weight, and the actual noise assumed for gages: demands jump by tens of kilonewtons.
    Aggressive,
    /// Like `Aggressive`, with a sixth of the shipped limit, at which jumps end.
    Saturating,
}

impl ControllerTuning {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Shipped, Self::Gentle, Self::Aggressive, Self::Saturating];

    /// Its name.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Shipped => "shipped",
            Self::Gentle => "gentle",
            Self::Aggressive => "aggressive",
            Self::Saturating => "saturating",
        }
    }

    /// The parameters of the plant with this controller.
    fn of(self, parameters: &PlantParameters) -> PlantParameters {
        let mut other = parameters.clone();
        let (effort, gage_noise, limit) = match self {
            Self::Shipped => (1.0, 1.0, 1.0),
            Self::Gentle => (10.0, 4.0, 1.0),
            Self::Aggressive => (0.1, 0.2, 1.0),
            Self::Saturating => (0.1, 0.2, 1.0 / 6.0),
        };
        other.controller.effort_weight *= effort;
        other.controller.gage_noise_factor *= gage_noise;
        other.hydraulics.demand_limit_n *= limit;
        other
    }
}

impl fmt::Display for ControllerTuning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// The common properties of the cases of a campaign.
#[derive(Debug, Clone)]
pub struct System {
    /// Its name: its weather.
    pub name: String,
    /// The structure as described.
    pub structure: Structure,
    /// The plant's parameters as described, its weather included.
    pub parameters: PlantParameters,
    /// The diagnosers, in the order of the structure's modules.
    pub setups: Vec<ModuleSetup>,
    /// The mismatch between each plant and its description; 0 for none.
    pub mismatch: f64,
    /// The controllers that plants use in turn; empty for the shipped one.
    pub controllers: Vec<ControllerTuning>,
    /// The seed of all random draws.
    pub seed: u64,
}

/// A plant whose diagnosers have references.
#[derive(Debug, Clone)]
pub struct CommissionedPlant {
    /// Its number, from 0.
    pub number: u64,
    /// Its seed.
    pub seed: u64,
    /// The plant.
    pub site: PlantSite,
    /// The diagnosers.
    pub setups: Vec<ModuleSetup>,
}

/// A commissioned plant, and the capabilities of its references.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlantRow {
    /// Name of its system.
    pub system: String,
    /// Its number, from 0.
    pub number: u64,
    /// Its seed.
    pub seed: u64,
    /// One for each module.
    pub references: Vec<ReferenceRow>,
}

/// The capabilities of a reference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRow {
    /// Its module.
    pub module: ModuleName,
    /// Hours of healthy data from which it was learned.
    pub hours: f64,
    /// Threshold of gages.
    pub gage_threshold: f64,
    /// Threshold of cylinders.
    pub cylinder_threshold: f64,
    /// The largest statistics of snippets left out in validation: alone, and with the peers.
    pub largest_left_out: [f64; 2],
}

/// A diagnoser for each equipped module of a structure, as far as it follows from the description of structure and plant:
/// its part held by the rest's stiffness, all others its peers, settings for the sampling step. Thresholds are
/// placeholders, and no ratio is that of a root cause, until both are calibrated.
///
/// # Errors
/// The structure is a mechanism.
pub fn module_setups(
    structure: &Structure,
    parameters: &PlantParameters,
) -> Result<Vec<ModuleSetup>, ModelError> {
    let hydraulics = &parameters.hydraulics;
    let names: Vec<_> = structure.equipped().map(|module| module.name.clone()).collect();
    let detection = DetectionSettings::at(parameters.step_s);
    let setup = |module: &Module| {
        Ok(ModuleSetup {
            module: module.name.clone(),
            structure: structure.embedded(&module.name)?,
            hydraulics: (!module.actuators.is_empty()).then_some(NominalHydraulics {
                area_a_m2: hydraulics.area_a_m2,
                area_b_m2: hydraulics.area_b_m2,
                volume_a_m3: hydraulics.volume_a_m3,
                volume_b_m3: hydraulics.volume_b_m3,
                bulk_modulus_pa: hydraulics.bulk_modulus_pa,
                force_gain_m3_per_s_n: hydraulics.force_gain_m3_per_s_per_n,
                valve_flow_m3_per_s: hydraulics.valve_flow_m3_per_s,
                supply_pa: hydraulics.supply_pa,
                tank_pa: hydraulics.tank_pa,
                pressure_noise_pa: hydraulics.pressure_noise_pa,
                speed_uncertainty: 0.25,
            }),
            gage_noise_strain: parameters.gages.noise_strain,
            step_s: parameters.step_s,
            signals: SignalSettings::default(),
            detection,
            isolation: IsolationSettings::at(parameters.step_s, &detection),
            thresholds: vec![1.0; module.components().count()],
            learned: None,
            readings: Vec::new(),
            peers: names.iter().filter(|name| **name != module.name).cloned().collect(),
            reference: None,
        })
    };
    structure.equipped().map(setup).collect()
}

/// How many times larger the cylinders must be so that mean wind and live loads at the start of a run demand half of their
/// limit, on plants within 10 %. 1 if the demands stay below two thirds of the limit as it is.
///
/// # Errors
/// A plant cannot be created.
pub fn missing_cylinder_size(
    structure: &Structure,
    parameters: &PlantParameters,
) -> Result<f64, StudyError> {
    let limit_n = parameters.hydraulics.demand_limit_n;
    let mut unlimited = parameters.clone();
    unlimited.hydraulics.demand_limit_n = HydraulicParameters::NO_DEMAND_LIMIT_N;
    let mut largest_n: f64 = 0.0;
    for seed in PROBED_PLANTS {
        let mut plant = plant(structure, &unlimited, 0.1, seed)?;
        let demands = plant.advance().modules.iter().flat_map(|module| &module.demands_n);
        largest_n = demands.fold(largest_n, |largest, demand| largest.max(demand.abs()));
    }
    Ok(if 1.5 * largest_n > limit_n { 2.0 * largest_n / limit_n } else { 1.0 })
}

impl System {
    /// The shipped tower without diagnosers.
    #[cfg(test)]
    pub(crate) fn tower(seed: u64) -> Self {
        let text = include_str!("../../../configs/tower.toml");
        Self {
            name: String::new(),
            structure: Structure::from_toml(text).unwrap(),
            parameters: PlantParameters::default(),
            setups: Vec::new(),
            mismatch: 0.1,
            controllers: Vec::new(),
            seed,
        }
    }

    /// The number of steps in so many seconds.
    #[must_use]
    pub fn steps(&self, seconds: f64) -> u64 {
        (seconds / self.parameters.step_s).round() as u64
    }

    /// The first step at which every channel is watched.
    #[must_use]
    pub fn watched_from(&self) -> u64 {
        let warm_up = |setup: &ModuleSetup| {
            setup.detection.warm_up_vectors + setup.detection.divergence.window as u64
        };
        self.setups.iter().map(warm_up).max().unwrap_or(0)
    }

    /// The parameters of a plant with this seed, which determines its controller.
    fn parameters(&self, seed: u64) -> PlantParameters {
        let count = self.controllers.len().max(1) as u64;
        let place = usize::try_from(seed % count).unwrap_or_default();
        let controller = self.controllers.get(place).copied().unwrap_or(ControllerTuning::Shipped);
        controller.of(&self.parameters)
    }

    /// The rig of a run with its own plant, before its first step.
    ///
    /// # Errors
    /// A plant or diagnosers cannot be created.
    pub fn rig(&self, seed: u64, faults: Vec<TimedFault>) -> Result<Rig, StudyError> {
        let plant = plant(&self.structure, &self.parameters(seed), self.mismatch, seed)?;
        Ok(Rig::new(plant, self.setups.clone(), faults, RunId(seed))?)
    }

    /// Snippets that each plant is commissioned with.
    #[must_use]
    pub fn snippets_per_plant(&self) -> u64 {
        self.snippets(0).len() as u64
    }

    /// Draws and commissions a plant, `jobs` snippets at a time. `done` is called after each.
    ///
    /// # Errors
    /// A plant, diagnosers or a reference cannot be created.
    pub fn commission(
        &self,
        number: u64,
        jobs: usize,
        done: &(dyn Fn() + Sync),
    ) -> Result<CommissionedPlant, StudyError> {
        let mut seeds = generator(self.seed, FIRST_PLANT_STREAM | number);
        let (seed, first_snippet) = (seeds.next_u64(), seeds.next_u64());
        let site = PlantSite::drawn(&self.structure, &self.parameters(seed), self.mismatch, seed)?;
        let setups = site.commission(&self.setups, &self.snippets(first_snippet), jobs, done)?;
        Ok(CommissionedPlant { number, seed, site, setups })
    }

    fn snippets(&self, first_seed: u64) -> Vec<SnippetPlan> {
        let of_module = |setup: &ModuleSetup| {
            let module = setup.module.clone();
            let components = setup.components().into_iter();
            components
                .filter(|component| matches!(component, Component::Actuator(_)))
                .map(move |component| ComponentPath { module: module.clone(), component })
        };
        let actuators: Vec<ComponentPath> = self.setups.iter().flat_map(of_module).collect();
        usual_snippets(&actuators, first_seed, self.weather_snippets(), SNIPPET_S, STROKE_N)
    }

    /// Modules with many peers need more snippets, because their references have more values.
    fn weather_snippets(&self) -> u64 {
        let values = |setup: &ModuleSetup| {
            let known = self.setups.iter().filter(|other| {
                other.module == setup.module || setup.peers.contains(&other.module)
            });
            known.map(|other| other.components().len() as u64).sum::<u64>()
        };
        let most = self.setups.iter().map(values).max().unwrap_or(0);
        LEAST_WEATHER_SNIPPETS.max(most + MORE_THAN_VALUES)
    }
}

impl CommissionedPlant {
    /// The rig of a run, before its first step.
    ///
    /// # Errors
    /// A plant or diagnosers cannot be created.
    pub fn rig(&self, seed: u64, faults: Vec<TimedFault>) -> Result<Rig, StudyError> {
        Ok(Rig::new(self.site.plant(seed)?, self.setups.clone(), faults, RunId(seed))?)
    }

    /// One of its columns, drawn at random, loses this share of its stiffness.
    pub fn soften(&mut self, share: f64) {
        let mut draw = generator(self.seed, SOFTENED_STREAM);
        let members = self.site.truth.members.iter_mut();
        let mut columns: Vec<&mut Member> = members.filter(|member| member.is_upright()).collect();
        if !columns.is_empty() {
            let place = draw.random_range(0..columns.len());
            columns[place].stiffness_factor *= 1.0 - share;
        }
    }

    /// The capabilities of its references.
    #[must_use]
    pub fn row(&self, system: &System) -> PlantRow {
        let references = self.setups.iter().filter_map(|setup| {
            let reference = setup.reference.as_deref()?;
            Some(ReferenceRow {
                module: reference.module.clone(),
                hours: reference.hours,
                gage_threshold: reference.long.gage_threshold,
                cylinder_threshold: reference.cylinder_threshold,
                largest_left_out: reference.long.largest_left_out,
            })
        });
        let (system, references) = (system.name.clone(), references.collect());
        PlantRow { system, number: self.number, seed: self.seed, references }
    }

    /// The smallest bias of a gage that its module's reference states as detectable, with its peers \[m/m\].
    pub(crate) fn smallest_bias_strain(&self, gage: &ComponentPath) -> f64 {
        let reference = |setup: &ModuleSetup| {
            let reference = setup.reference.as_ref()?;
            let place = reference.gages.iter().position(|path| path == gage)?;
            let [_, together] = reference.smallest_biases_m();
            together.get(place).copied()
        };
        let own = self.setups.iter().find(|setup| setup.module == gage.module);
        let length_m = gage_length_m(&self.site.nominal, gage);
        own.and_then(reference).map_or(0.0, |smallest| smallest / length_m)
    }
}

/// Random numbers determined by a campaign's seed and the number of a stream.
pub(crate) fn generator(campaign_seed: u64, stream: u64) -> ChaCha8Rng {
    let mut generator = ChaCha8Rng::seed_from_u64(campaign_seed);
    generator.set_stream(stream);
    generator
}

/// Length of the gage; meaningless for an actuator.
pub(crate) fn gage_length_m(structure: &Structure, path: &ComponentPath) -> f64 {
    let module = structure.module(&path.module);
    let gages = module.map(|module| module.gages.as_slice()).unwrap_or_default();
    let gage = gages.iter().find(|gage| match &path.component {
        Component::Sensor(name) => gage.name == *name,
        Component::Actuator(_) => false,
    });
    gage.map_or(f64::NAN, |gage| structure.gage_length_m(gage))
}
