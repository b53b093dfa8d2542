//! A plant that differs from its nominal model.
//!
//! Tuning a diagnoser on the exact parameters of the simulated plant would prove nothing. Here every stiffness, mass
//! and damping, the chamber volumes, the gain of the force control and the noise levels are multiplied by separate
//! factors, uniform within 1 ± amount.

use rand::RngExt;
use truss::{Perturbation, Structure};

use crate::check::{Checks, ParameterErrors};
use crate::parameters::PlantParameters;
use crate::streams::Stream;

/// True structure and parameters, drawn around the nominal ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Mismatch {
    /// Factors on the structure's members, nodes and damping.
    pub perturbation: Perturbation,
    /// The plant's true parameters.
    pub parameters: PlantParameters,
}

impl Mismatch {
    /// Draws factors within 1 ± `amount` (e.g. 0.1); the same seed gives the same factors.
    ///
    /// # Errors
    /// An amount below 0 or above 0.9.
    pub fn draw(
        nominal: &Structure,
        parameters: &PlantParameters,
        amount: f64,
        seed: u64,
    ) -> Result<Self, ParameterErrors> {
        let mut checks = Checks::default();
        checks.require(
            "mismatch",
            (0.0..=0.9).contains(&amount),
            amount,
            "a relative amount from 0 to 0.9",
        );
        checks.finish()?;
        let mut generator = Stream::Mismatch.generator(seed);
        let mut draw = || {
            let place: f64 = generator.random();
            1.0 + amount * (2.0 * place - 1.0)
        };
        let mut perturbation = Perturbation::identity(nominal);
        perturbation.member_stiffness.iter_mut().for_each(|factor| *factor = draw());
        perturbation.node_mass.iter_mut().for_each(|factor| *factor = draw());
        perturbation.damping = draw();
        let mut parameters = parameters.clone();
        let hydraulics = &mut parameters.hydraulics;
        for value in [
            &mut hydraulics.volume_a_m3,
            &mut hydraulics.volume_b_m3,
            &mut hydraulics.force_gain_m3_per_s_per_n,
            &mut hydraulics.pressure_noise_pa,
            &mut parameters.gages.noise_strain,
        ] {
            *value *= draw();
        }
        parameters.gages.gain_seed = seed;
        Ok(Self { perturbation, parameters })
    }

    /// The true structure.
    #[must_use]
    pub fn structure(&self, nominal: &Structure) -> Structure {
        nominal.perturbed(&self.perturbation)
    }
}
