//! Snippets of the simulated plant.

use daemon::config::{MismatchSection, PlantConfig, PlantFlags, load_plant};
use diagnosis::ModuleSetup;
use diagnosis::state::Snippet;
use study::commissioning::{PlantSite, SnippetPlan, record_snippets, usual_snippets};
use vocabulary::{Component, ComponentPath};

use super::arguments::SnippetFlags;
use crate::failure::Failure;
use crate::progress::WorkProgress;

impl SnippetFlags {
    /// The plant's configuration, if snippets are to be simulated.
    pub(super) fn load(&self) -> Result<Option<PlantConfig>, Failure> {
        let load = |file| load_plant(file, &PlantFlags::default());
        Ok(self.plant.as_deref().map(load).transpose()?)
    }

    /// Which snippets are to be made.
    pub(super) fn plans(&self, setups: &[ModuleSetup]) -> Vec<SnippetPlan> {
        let actuators: Vec<ComponentPath> = setups.iter().flat_map(actuators).collect();
        usual_snippets(&actuators, self.seed, self.snippets, self.seconds, self.stroke_n)
    }

    /// Makes them.
    pub(super) fn record(
        &self,
        plant: &PlantConfig,
        setups: &[ModuleSetup],
        plans: &[SnippetPlan],
    ) -> Result<Vec<Snippet>, Failure> {
        let site = self.site(plant)?;
        let progress = WorkProgress::new("commissioning", "snippets", plans.len() as u64);
        record_snippets(&site, setups, plans, self.jobs(), &|| progress.advance())
            .map_err(|error| Failure::input(error.to_string()))
    }

    /// The plant as it stands: flags come before its file.
    fn site(&self, plant: &PlantConfig) -> Result<PlantSite, Failure> {
        let flags = self.mismatch.zip(self.plant_seed);
        let drawn = flags.map(|(relative, seed)| MismatchSection { relative, seed });
        let (structure, parameters) = (&plant.structure, &plant.parameters);
        match drawn.or(plant.mismatch).filter(|mismatch| mismatch.relative > 0.0) {
            None => Ok(PlantSite::nominal(structure, parameters)),
            Some(MismatchSection { relative, seed }) => {
                PlantSite::drawn(structure, parameters, relative, seed)
                    .map_err(|error| Failure::input(error.to_string()))
            }
        }
    }
}

fn actuators(setup: &ModuleSetup) -> impl Iterator<Item = ComponentPath> {
    let path = |component| ComponentPath { module: setup.module.clone(), component };
    let components = setup.components().into_iter();
    components.filter(|component| matches!(component, Component::Actuator(_))).map(path)
}
