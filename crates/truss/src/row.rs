//! Copies of a structure side by side.

use crate::local_structure::{renumber_member, renumber_module};
use crate::member::Member;
use crate::structure::{Module, Node, Structure};
use vocabulary::{MemberName, ModuleName, NameError, NodeName, StructureName};

impl Structure {
    /// This many separate copies of the structure in a row along x, spaced by the structure's width. Names are prefixed
    /// with the number of the copy, `t07-module1`; the row is named after the structure and the number of copies,
    /// `tower-x25`.
    ///
    /// # Errors
    /// A name becomes too long.
    pub fn row(&self, copies: usize) -> Result<Structure, NameError> {
        let mut row = Structure {
            name: StructureName::new(format!("{}-x{copies}", self.name))?,
            damping: self.damping,
            nodes: Vec::with_capacity(copies * self.nodes.len()),
            members: Vec::with_capacity(copies * self.members.len()),
            modules: Vec::with_capacity(copies * self.modules.len()),
            surroundings: Vec::new(),
        };
        let spacing_m = 2.0 * self.width_m();
        for copy in 0..copies {
            let prefix = copy_prefix(copy, copies);
            let (first_node, first_member) = (row.nodes.len(), row.members.len());
            for node in &self.nodes {
                row.nodes.push(moved_node(node, &prefix, copy as f64 * spacing_m)?);
            }
            for member in &self.members {
                let name = MemberName::new(format!("{prefix}{}", member.name))?;
                let moved = renumber_member(member, |node| node + first_node);
                row.members.push(Member { name, ..moved });
            }
            for module in &self.modules {
                let name = ModuleName::new(format!("{prefix}{}", module.name))?;
                let moved = renumber_module(
                    module,
                    |node| node + first_node,
                    |member| member + first_member,
                );
                row.modules.push(Module { name, ..moved });
            }
            let moved = self.surroundings.iter().map(|of| of.renumbered(|node| node + first_node));
            row.surroundings.extend(moved);
        }
        Ok(row)
    }

    /// Extent along x \[m\].
    fn width_m(&self) -> f64 {
        let places = self.nodes.iter().map(|node| node.position_m[0]);
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
            (low.min(place), high.max(place))
        });
        if high > low { high - low } else { 0.0 }
    }
}

/// The prefix of the names in a copy, counted from 0.
#[must_use]
pub fn copy_prefix(copy: usize, copies: usize) -> String {
    let digits = copies.to_string().len().max(2);
    format!("t{:0digits$}-", copy + 1)
}

fn moved_node(node: &Node, prefix: &str, by_m: f64) -> Result<Node, NameError> {
    let [x, y, z] = node.position_m;
    let name = NodeName::new(format!("{prefix}{}", node.name))?;
    Ok(Node { name, position_m: [x + by_m, y, z], ..node.clone() })
}
