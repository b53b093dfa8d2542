//! A plant as it stands, which may differ from its description.

use plant::{Mismatch, Plant, PlantParameters};
use truss::Structure;

use crate::error::StudyError;

/// A healthy plant as it stands, and as it is described.
#[derive(Debug, Clone)]
pub struct PlantSite {
    /// The structure as it is.
    pub truth: Structure,
    /// The structure as described.
    pub nominal: Structure,
    /// The plant's parameters as they are.
    pub true_parameters: PlantParameters,
    /// As described.
    pub nominal_parameters: PlantParameters,
}

impl PlantSite {
    /// A plant that is just as described.
    #[must_use]
    pub fn nominal(structure: &Structure, parameters: &PlantParameters) -> Self {
        Self {
            truth: structure.clone(),
            nominal: structure.clone(),
            true_parameters: parameters.clone(),
            nominal_parameters: parameters.clone(),
        }
    }

    /// A plant whose figures are drawn within 1 ± `mismatch` of those described; the same seed gives the same plant.
    ///
    /// # Errors
    /// A mismatch out of range.
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

    /// The plant in a run of its own: another wind, other loads, another hour.
    ///
    /// # Errors
    /// A plant that cannot be made.
    pub fn plant(&self, seed: u64) -> Result<Plant, StudyError> {
        let (truth, nominal) = (&self.truth, &self.nominal);
        let parameters = (&self.true_parameters, &self.nominal_parameters);
        Ok(Plant::with_nominal(truth, nominal, parameters.0, parameters.1, seed)?)
    }
}
