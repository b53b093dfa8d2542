//! Separates a structure into unconnected parts.
//!
//! Parts without a common member or module do not move each other. Each has its own modes, and the joint model is
//! block-diagonal: a matrix of many towers would consist mostly of zeros.

use std::collections::BTreeMap;

use crate::local_structure::{places, renumber_member, renumber_module};
use crate::structure::Structure;

impl Structure {
    /// The parts of the structure that are not connected by a member or a module, in the order of their first nodes.
    /// Nodes, members and modules of each part keep their order. A connected structure is its only part.
    #[must_use]
    pub fn parts(&self) -> Vec<Structure> {
        let groups = self.groups();
        if groups.len() == 1 {
            return vec![self.clone()];
        }
        groups.iter().map(|nodes| self.part(nodes)).collect()
    }

    /// The nodes of each part, ascending.
    fn groups(&self) -> Vec<Vec<usize>> {
        let mut forest = Forest((0..self.nodes.len()).collect());
        for member in &self.members {
            forest.join(member.ends[0], member.ends[1]);
        }
        for module in &self.modules {
            for pair in module.nodes.windows(2) {
                forest.join(pair[0], pair[1]);
            }
        }
        for known in &self.surroundings {
            for pair in known.freedoms.windows(2) {
                forest.join(pair[0].node, pair[1].node);
            }
        }
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for node in 0..self.nodes.len() {
            groups.entry(forest.first(node)).or_default().push(node);
        }
        groups.into_values().collect()
    }

    fn part(&self, nodes: &[usize]) -> Structure {
        let node_places = places(nodes);
        let here = |node: usize| nodes.binary_search(&node).is_ok();
        let members: Vec<usize> =
            (0..self.members.len()).filter(|&member| here(self.members[member].ends[0])).collect();
        let member_places = places(&members);
        let modules =
            self.modules.iter().filter(|module| module.nodes.first().is_some_and(|&n| here(n)));
        Structure {
            name: self.name.clone(),
            damping: self.damping,
            nodes: nodes.iter().map(|&node| self.nodes[node].clone()).collect(),
            members: members
                .iter()
                .map(|&member| renumber_member(&self.members[member], &node_places))
                .collect(),
            modules: modules
                .map(|module| renumber_module(module, &node_places, &member_places))
                .collect(),
            surroundings: self.surroundings_of(nodes).collect(),
        }
    }
}

/// Connected nodes: each points to an earlier one of its group, the first to itself.
struct Forest(Vec<usize>);

impl Forest {
    /// The first node of the group of a node.
    fn first(&mut self, mut node: usize) -> usize {
        while self.0[node] != node {
            // Path halving, which shortens the next search.
            self.0[node] = self.0[self.0[node]];
            node = self.0[node];
        }
        node
    }

    fn join(&mut self, one: usize, other: usize) {
        let (one, other) = (self.first(one), self.first(other));
        self.0[one.max(other)] = one.min(other);
    }
}
