//! Copies of a structure side by side.

use crate::member::Member;
use crate::structure::{Actuator, Gage, Module, Node, Structure};
use vocabulary::{MemberName, ModuleName, NameError, NodeName, StructureName};

impl Structure {
    /// This many copies of the structure in a row along x, as far apart as each is wide, each standing by
    /// itself. Names get the number of the copy in front, `t07-module1`; the row is called after the
    /// structure and the number of copies, `tower-x25`.
    ///
    /// # Errors
    /// A name that gets too long.
    pub fn row(&self, copies: usize) -> Result<Structure, NameError> {
        let mut row = Structure {
            name: StructureName::new(format!("{}-x{copies}", self.name))?,
            damping: self.damping,
            nodes: Vec::with_capacity(copies * self.nodes.len()),
            members: Vec::with_capacity(copies * self.members.len()),
            modules: Vec::with_capacity(copies * self.modules.len()),
        };
        let spacing_m = 2.0 * self.width_m();
        for copy in 0..copies {
            let prefix = copy_prefix(copy, copies);
            let (first_node, first_member) = (row.nodes.len(), row.members.len());
            for node in &self.nodes {
                row.nodes.push(moved_node(node, &prefix, copy as f64 * spacing_m)?);
            }
            for member in &self.members {
                row.members.push(moved_member(member, &prefix, first_node)?);
            }
            for module in &self.modules {
                row.modules.push(moved_module(module, &prefix, first_node, first_member)?);
            }
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

/// What stands before the names in a copy, counted from 0.
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

fn moved_member(member: &Member, prefix: &str, first_node: usize) -> Result<Member, NameError> {
    let name = MemberName::new(format!("{prefix}{}", member.name))?;
    Ok(Member { name, ends: member.ends.map(|end| end + first_node), ..member.clone() })
}

fn moved_module(
    module: &Module,
    prefix: &str,
    first_node: usize,
    first_member: usize,
) -> Result<Module, NameError> {
    let nodes = |nodes: &[usize]| nodes.iter().map(|node| node + first_node).collect();
    let actuator = |actuator: &Actuator| Actuator {
        name: actuator.name.clone(),
        ends: actuator.ends.map(|end| end + first_node),
        member: actuator.member.map(|member| member + first_member),
    };
    let gage = |gage: &Gage| Gage { name: gage.name.clone(), member: gage.member + first_member };
    Ok(Module {
        name: ModuleName::new(format!("{prefix}{}", module.name))?,
        nodes: nodes(&module.nodes),
        members: module.members.iter().map(|member| member + first_member).collect(),
        lower_interface: nodes(&module.lower_interface),
        actuators: module.actuators.iter().map(actuator).collect(),
        gages: module.gages.iter().map(gage).collect(),
    })
}
