//! Cases of several plants, each commissioned before its cases.

use diagnosis::ModuleSetup;
use names::{Component, ComponentPath};
use plant::PlantParameters;
use rand::Rng;
use truss::Structure;

use super::draw::{Case, CaseKind};
use crate::commissioning::{Site, SnippetPlan, usual_snippets};
use crate::error::StudyError;
use crate::scenario::{gage_length_m, generator};

/// Plants draw from streams of their own.
const FIRST_PLANT_STREAM: u64 = 7 << 60;
/// What each plant is commissioned with: snippets under its weather beside two strokes of each cylinder, no less than these
/// and so many more than the values of a reference; their length, and the force of the strokes.
const LEAST_WEATHER_SNIPPETS: u64 = 40;
const MORE_THAN_VALUES: u64 = 12;
const SNIPPET_S: f64 = 12.0;
const STROKE_N: f64 = 100e3;

/// A campaign.
#[derive(Debug, Clone)]
pub struct ConditionCampaign {
    /// The structure as described.
    pub structure: Structure,
    /// The plant's parameters as described, its weather included.
    pub parameters: PlantParameters,
    /// The diagnosers, in the order of the structure.
    pub setups: Vec<ModuleSetup>,
    /// By how much each plant differs from its description.
    pub mismatch: f64,
    /// What everything follows from.
    pub seed: u64,
    /// Cases of each plant.
    pub cases_per_plant: u64,
    /// Which.
    pub kind: CaseKind,
}

/// A plant whose diagnosers have references.
#[derive(Debug, Clone)]
pub struct CommissionedPlant {
    /// Its number, from 0.
    pub number: u64,
    /// Its seed.
    pub seed: u64,
    /// The plant.
    pub site: Site,
    /// The diagnosers.
    pub setups: Vec<ModuleSetup>,
}

impl CommissionedPlant {
    /// The smallest bias of a gage that its module's reference is stated to find, with its peers \[m/m\].
    fn smallest_bias_strain(&self, structure: &Structure, gage: &ComponentPath) -> f64 {
        let reference = |setup: &ModuleSetup| {
            let reference = setup.reference.as_ref()?;
            let place = reference.gages.iter().position(|path| path == gage)?;
            let [_, together] = reference.smallest_biases_m();
            together.get(place).copied()
        };
        let own = self.setups.iter().find(|setup| setup.module == gage.module);
        own.and_then(reference).map_or(0.0, |smallest| smallest / gage_length_m(structure, gage))
    }
}

impl ConditionCampaign {
    /// The number of the plant that a case is of.
    #[must_use]
    pub fn plant_of(&self, case: u64) -> u64 {
        case / self.cases_per_plant.max(1)
    }

    /// Snippets that each plant is commissioned with.
    #[must_use]
    pub fn snippets_per_plant(&self) -> u64 {
        self.snippets(0).len() as u64
    }

    /// Makes and commissions a plant, `jobs` snippets at a time. `done` is called after each.
    ///
    /// # Errors
    /// A plant or diagnosers that cannot be made, or a reference.
    pub fn commission(
        &self,
        number: u64,
        jobs: usize,
        done: &(dyn Fn() + Sync),
    ) -> Result<CommissionedPlant, StudyError> {
        let mut seeds = generator(self.seed, FIRST_PLANT_STREAM | number);
        let (seed, first_snippet) = (seeds.next_u64(), seeds.next_u64());
        let site = Site::drawn(&self.structure, &self.parameters, self.mismatch, seed)?;
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

    /// Modules with many peers need more: their references have more values.
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

    /// Draws a case of a plant. Its faults are larger than what the plant's references are stated to find.
    ///
    /// # Errors
    /// Nothing in the structure can break.
    pub fn case(&self, plant: &CommissionedPlant, number: u64) -> Result<Case, StudyError> {
        let step_s = self.parameters.step_s;
        let smallest = |gage: &ComponentPath| plant.smallest_bias_strain(&self.structure, gage);
        Case::draw(self.kind, &smallest, &self.structure, step_s, self.seed, number)
            .ok_or(StudyError::NothingToBreak)
    }
}
