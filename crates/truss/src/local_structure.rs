//! Extracts one module from a structure.

use std::collections::BTreeMap;

use crate::direction::Support;
use crate::member::Member;
use crate::model_error::ModelError;
use crate::structure::{Actuator, Gage, Module, Structure};
use crate::surroundings::Surroundings;
use vocabulary::ModuleName;

impl Structure {
    /// The module alone: its own nodes, members, actuators and gages, clamped at the nodes on which it stands on the
    /// module below. The lowest module keeps its supports. Extracting from the result again changes nothing.
    ///
    /// # Errors
    /// The structure has no module of this name.
    pub fn local(&self, module: &ModuleName) -> Result<Structure, ModelError> {
        let mut local = self.free(module)?;
        let Some(module) = self.module(module) else { return Ok(local) };
        for (node, &place) in local.nodes.iter_mut().zip(&module.nodes) {
            if module.lower_interface.contains(&place) {
                node.support = Support::CLAMPED;
            }
        }
        Ok(local)
    }

    /// The module alone, held by nothing but its own supports.
    pub(crate) fn free(&self, module: &ModuleName) -> Result<Structure, ModelError> {
        let module = self.module(module).ok_or_else(|| self.unknown_module(module))?;
        let node_places = places(&module.nodes);
        let member_places = places(&module.members);
        let alone = renumber_module(module, &node_places, &member_places);
        Ok(Structure {
            name: self.name.clone(),
            damping: self.damping,
            nodes: module.nodes.iter().map(|&node| self.nodes[node].clone()).collect(),
            members: module
                .members
                .iter()
                .map(|&member| renumber_member(&self.members[member], &node_places))
                .collect(),
            modules: vec![Module { lower_interface: Vec::new(), ..alone }],
            surroundings: self.surroundings_of(&module.nodes).collect(),
        })
    }

    /// The surroundings that act on some nodes only, which are renumbered in this order.
    pub(crate) fn surroundings_of(&self, nodes: &[usize]) -> impl Iterator<Item = Surroundings> {
        let of_nodes =
            |known: &&Surroundings| known.freedoms.iter().all(|dof| nodes.contains(&dof.node));
        self.surroundings.iter().filter(of_nodes).map(|known| known.renumbered(places(nodes)))
    }

    pub(crate) fn unknown_module(&self, module: &ModuleName) -> ModelError {
        let known: Vec<_> = self.modules.iter().map(|known| format!("`{}`", known.name)).collect();
        ModelError::UnknownModule {
            module: module.clone(),
            structure: self.name.to_string(),
            known: known.join(", "),
        }
    }
}

/// Maps old indices to new ones. Validation has added every node of a module's members, actuators and gages to the
/// module's own lists, so every index is found.
pub(crate) fn places(kept: &[usize]) -> impl Fn(usize) -> usize {
    let places: BTreeMap<usize, usize> =
        kept.iter().enumerate().map(|(new, &old)| (old, new)).collect();
    move |old| places[&old]
}

pub(crate) fn renumber_member(member: &Member, node: impl Fn(usize) -> usize) -> Member {
    Member { ends: member.ends.map(node), ..member.clone() }
}

pub(crate) fn renumber_module(
    module: &Module,
    node: impl Fn(usize) -> usize,
    member: impl Fn(usize) -> usize,
) -> Module {
    let nodes = |nodes: &[usize]| nodes.iter().map(|&old| node(old)).collect();
    let actuator = |actuator: &Actuator| Actuator {
        name: actuator.name.clone(),
        ends: actuator.ends.map(&node),
        member: actuator.member.map(&member),
    };
    let gage = |gage: &Gage| Gage { name: gage.name.clone(), member: member(gage.member) };
    Module {
        name: module.name.clone(),
        nodes: nodes(&module.nodes),
        members: module.members.iter().map(|&old| member(old)).collect(),
        lower_interface: nodes(&module.lower_interface),
        actuators: module.actuators.iter().map(actuator).collect(),
        gages: module.gages.iter().map(gage).collect(),
    }
}
