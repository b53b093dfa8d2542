//! The rest of a structure, as one of its modules feels it.
//!
//! A module is rarely held as a cantilever is. What it lacks of the structure resists the motion of the nodes that they
//! share: K_s = K_ii − K_ir·K_rr⁻¹·K_ri, with K the stiffness of all other members, i the directions of the shared nodes
//! and r all other ones, which carry no load (static condensation, Guyan). With K_s a local model is exact for constant
//! forces of the module's own cylinders, however the structure is supported; what it lacks is the rest's inertia.

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use crate::assembly::{Dof, Freedoms, Mechanics, condensed_stiffness};
use crate::local_structure::places;
use crate::member::Member;
use crate::model_error::ModelError;
use crate::structure::{Actuator, Module, Structure};
use vocabulary::{ActuatorName, GageName, ModuleName};

/// A pair of a cylinder and a gage matters if its effect is at least this share of the gage's largest.
const MATTERS: f64 = 0.1;
/// Effects below this share of the largest effect are ignored.
const ROUNDING: f64 = 1e-6;
/// A local model that misses more than this share of an effect is to be warned of.
const MOST_MISSED: f64 = 1.0 / 3.0;

/// Stiffness that is not of the structure's own members, between directions of its nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Surroundings {
    /// The directions, each once.
    pub freedoms: Vec<Dof>,
    /// The stiffness between them (freedoms × freedoms), symmetric \[N/m, N, N·m\].
    pub stiffness: DMatrix<f64>,
}

impl Surroundings {
    /// The same with other numbers of nodes.
    pub(crate) fn renumbered(&self, node: impl Fn(usize) -> usize) -> Self {
        let freedom = |dof: &Dof| Dof { node: node(dof.node), ..*dof };
        Self {
            freedoms: self.freedoms.iter().map(freedom).collect(),
            stiffness: self.stiffness.clone(),
        }
    }
}

/// The effect of a cylinder's constant force on a gage, by the local model and by the whole structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// The gage, of the module.
    pub gage: GageName,
    /// The cylinder's module,
    pub module: ModuleName,
    /// and its name.
    pub actuator: ActuatorName,
    /// By the local model, 0 of other modules' cylinders \[m/N\].
    pub local_m_per_n: f64,
    /// By the whole structure \[m/N\].
    pub whole_m_per_n: f64,
    /// Whether the effect is at least a tenth of the largest on this gage.
    pub matters: bool,
}

impl Prediction {
    /// Share of the effect that the local model predicts; 1 is exact, infinite if the whole structure has no such effect.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.local_m_per_n / self.whole_m_per_n
    }

    /// Whether a local model is wrong by more than a third of an effect that matters.
    #[must_use]
    pub fn is_wrong(&self) -> bool {
        let miss = (self.local_m_per_n - self.whole_m_per_n).abs();
        self.matters && miss > MOST_MISSED * self.whole_m_per_n.abs()
    }
}

impl Structure {
    /// The module alone, held by its own supports and by the statically condensed stiffness of the rest of the structure.
    /// Unlike [`Structure::local`] it fits any structure: bridges, frames, what is supported at both ends.
    ///
    /// # Errors
    /// The structure has no module of this name, or is a mechanism.
    pub fn embedded(&self, name: &ModuleName) -> Result<Structure, ModelError> {
        let mut alone = self.free(name)?;
        let module = self.module(name).ok_or_else(|| self.unknown_module(name))?;
        let others: Vec<Member> = (0..self.members.len())
            .filter(|member| !module.members.contains(member))
            .map(|member| self.members[member].clone())
            .collect();
        let condensed = self.condensed(module, &alone, others)?;
        alone.surroundings.extend(condensed);
        Ok(alone)
    }

    /// What the other members do to the nodes of the module.
    fn condensed(
        &self,
        module: &Module,
        alone: &Structure,
        others: Vec<Member>,
    ) -> Result<Vec<Surroundings>, ModelError> {
        let touched: BTreeSet<usize> = others.iter().flat_map(|member| member.ends).collect();
        let place = places(&module.nodes);
        let own = Freedoms::number(alone);
        let rest = Structure { members: others, surroundings: Vec::new(), ..self.clone() };
        let all = Freedoms::number(&rest);
        let is_shared = |dof: &&Dof| {
            let alone = |node| Dof { node, ..**dof };
            module.nodes.contains(&dof.node) && own.dofs.contains(&alone(place(dof.node)))
        };
        let shared: Vec<Dof> = all
            .dofs
            .iter()
            .filter(|dof| touched.contains(&dof.node))
            .filter(is_shared)
            .copied()
            .collect();
        if shared.is_empty() {
            return Ok(Vec::new());
        }
        let stiffness = condensed_stiffness(&rest, &all, &shared, &touched)?;
        let shared = Surroundings { freedoms: shared, stiffness };
        Ok(vec![shared.renumbered(place)])
    }

    /// How much of the effect of every cylinder of the structure on each gage of a module its local model predicts.
    ///
    /// # Errors
    /// One of the two is a mechanism.
    pub fn predictions(&self, local: &Structure) -> Result<Vec<Prediction>, ModelError> {
        let (of_all, of_own) = (static_response(self)?, static_response(local)?);
        let Some(module) = local.modules.first() else { return Ok(Vec::new()) };
        let before = self.modules.iter().take_while(|other| other.name != module.name);
        let first_gage: usize = before.map(|other| other.gages.len()).sum();
        let actuators: Vec<_> = (self.modules.iter())
            .flat_map(|of| of.actuators.iter().map(move |actuator| (&of.name, &actuator.name)))
            .collect();
        let mut predictions = Vec::new();
        // What is smaller is rounding: in a statically determinate structure many effects are none.
        let rounding = ROUNDING * of_all.amax();
        for (row, gage) in module.gages.iter().enumerate() {
            let of_gage = actuators.iter().enumerate().map(|(column, (of, name))| {
                let is_this = |own: &Actuator| **of == module.name && own.name == **name;
                let own = module.actuators.iter().position(is_this);
                let local_m_per_n = own.map_or(0.0, |own| of_own[(row, own)]);
                (*of, *name, local_m_per_n, of_all[(first_gage + row, column)])
            });
            let of_gage: Vec<_> = of_gage.collect();
            let larger = |(_, _, local, whole): &(_, _, f64, f64)| local.abs().max(whole.abs());
            let largest = of_gage.iter().map(larger).fold(rounding, f64::max);
            for effect in &of_gage {
                let (of, name, local_m_per_n, whole_m_per_n) = *effect;
                predictions.push(Prediction {
                    gage: gage.name.clone(),
                    module: of.clone(),
                    actuator: name.clone(),
                    local_m_per_n,
                    whole_m_per_n,
                    matters: larger(effect) >= (MATTERS * largest).max(rounding),
                });
            }
        }
        Ok(predictions)
    }
}

fn static_response(structure: &Structure) -> Result<DMatrix<f64>, ModelError> {
    Mechanics::assemble(structure)?.static_gage_responses()
}
