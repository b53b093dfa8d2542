//! An installed plant, which may differ from its description.

use plant::{Mismatch, Plant, PlantParameters};
use truss::Structure;

use crate::error::StudyError;

/// A healthy installed plant, and its description.
#[derive(Debug, Clone)]
pub struct PlantSite {
    /// The true structure.
    pub truth: Structure,
    /// The described structure.
    pub nominal: Structure,
    /// The true parameters.
    pub true_parameters: PlantParameters,
    /// The described parameters.
    pub nominal_parameters: PlantParameters,
}

impl PlantSite {
    /// A plant that equals its description.
    #[must_use]
    pub fn nominal(structure: &Structure, parameters: &PlantParameters) -> Self {
        Self {
            truth: structure.clone(),
            nominal: structure.clone(),
            true_parameters: parameters.clone(),
            nominal_parameters: parameters.clone(),
        }
    }

    /// A plant whose parameters are drawn within 1 ± `mismatch` of the described ones; the same seed gives the same
    /// plant.
    ///
    /// # Errors
    /// The mismatch is out of range.
    pub fn drawn(
        structure: &Structure,
        parameters: &PlantParameters,
        mismatch: f64,
        seed: u64,
    ) -> Result<Self, StudyError> {
        let drawn = Mismatch::draw(structure, parameters, mismatch, seed)?;
        let described = Self::nominal(structure, parameters);
        let truth = drawn.structure(structure);
        Ok(Self { truth, true_parameters: drawn.parameters, ..described })
    }

    /// The plant in a new run with different wind, loads and time of day.
    ///
    /// # Errors
    /// The plant cannot be created.
    pub fn plant(&self, seed: u64) -> Result<Plant, StudyError> {
        let (truth, nominal) = (&self.truth, &self.nominal);
        let parameters = (&self.true_parameters, &self.nominal_parameters);
        Ok(Plant::with_nominal(truth, nominal, parameters.0, parameters.1, seed)?)
    }
}
