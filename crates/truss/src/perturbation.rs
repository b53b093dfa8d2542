//! A structure with small deviations from its nominal model.

use crate::structure::{Rayleigh, Structure};

/// Factors on the properties of a structure; each must be finite and above 0, which
/// [`crate::Mechanics::assemble`] checks.
#[derive(Debug, Clone, PartialEq)]
pub struct Perturbation {
    /// Factor on E·A, E·I and G·J of each member, in the order of [`Structure::members`].
    pub member_stiffness: Vec<f64>,
    /// Factor on the total mass lumped at each node, in the order of [`Structure::nodes`].
    pub node_mass: Vec<f64>,
    /// Factor on both coefficients of Rayleigh damping.
    pub damping: f64,
}

impl Perturbation {
    /// A perturbation with all factors 1.
    #[must_use]
    pub fn identity(structure: &Structure) -> Perturbation {
        Perturbation {
            member_stiffness: vec![1.0; structure.members.len()],
            node_mass: vec![1.0; structure.nodes.len()],
            damping: 1.0,
        }
    }
}

impl Structure {
    /// The structure with the factors multiplied by its present ones. Members and nodes beyond the end of the
    /// perturbation's lists are unchanged.
    #[must_use]
    pub fn perturbed(&self, perturbation: &Perturbation) -> Structure {
        let mut perturbed = self.clone();
        for (member, factor) in perturbed.members.iter_mut().zip(&perturbation.member_stiffness) {
            member.stiffness_factor *= factor;
        }
        for (node, factor) in perturbed.nodes.iter_mut().zip(&perturbation.node_mass) {
            node.mass_factor *= factor;
        }
        perturbed.damping = Rayleigh {
            alpha_per_s: self.damping.alpha_per_s * perturbation.damping,
            beta_s: self.damping.beta_s * perturbation.damping,
        };
        perturbed
    }
}
