//! Generates the nodes and members described by `[storeys]`.
//!
//! A tower on a polygon has one node per corner at each level; `L00C1` is the first corner of the base. Each storey has
//! a column at each corner, a horizontal along each side of the upper floor and, if requested, a diagonal between any
//! two corners of that floor that are not neighbours. Each face of a module has two crossing diagonals, corner to
//! corner over the module's whole height. A member is named after its ends, `L00C1-L01C1`.

use crate::description::{MemberDescription, NodeDescription, StoreysDescription};

/// The data of a module that the generator needs.
pub(crate) struct Stack<'a> {
    /// Name of the module.
    pub(crate) module: &'a str,
    /// Its number of storeys.
    pub(crate) storeys: usize,
    /// Section of its columns.
    pub(crate) column: &'a str,
}

/// Name of a node from its level and the corner, counted from 0.
pub(crate) fn node_name(level: usize, corner: usize) -> String {
    format!("L{level:02}C{}", corner + 1)
}

/// The nodes of the levels 0 to `storeys`.
pub(crate) fn nodes(storeys: usize, plan: &StoreysDescription) -> Vec<NodeDescription> {
    let corners = plan.corners_m.len() as f64;
    let mut nodes = Vec::new();
    for level in 0..=storeys {
        let ground = level == 0;
        for (corner, &[x, y]) in plan.corners_m.iter().enumerate() {
            nodes.push(NodeDescription {
                name: node_name(level, corner),
                position_m: [x, y, level as f64 * plan.height_m],
                mass_kg: if ground { 0.0 } else { plan.mass_kg / corners },
                fixed: if ground { plan.base.clone() } else { Vec::new() },
                mass_factor: 1.0,
            });
        }
    }
    nodes
}

/// The members of all modules, lowest module first.
pub(crate) fn members(stacks: &[Stack<'_>], plan: &StoreysDescription) -> Vec<MemberDescription> {
    let mut members = Vec::new();
    let mut bottom = 0;
    for stack in stacks {
        let top = bottom + stack.storeys;
        for level in bottom..top {
            members.extend(storey(stack, plan, level));
        }
        members.extend(faces(stack, plan, bottom, top));
        bottom = top;
    }
    members
}

/// Columns from a level to the next, and the floor of the upper one.
fn storey(stack: &Stack<'_>, plan: &StoreysDescription, level: usize) -> Vec<MemberDescription> {
    let corners = plan.corners_m.len();
    let column = |corner| member(stack, stack.column, (level, corner), (level + 1, corner));
    let mut members: Vec<_> = (0..corners).map(column).collect();
    members.extend(sides(corners).map(|(corner, next)| {
        member(stack, &plan.horizontal, (level + 1, corner), (level + 1, next))
    }));
    if let Some(section) = &plan.floor_diagonal {
        members.extend(across(corners).map(|(corner, other)| {
            member(stack, section, (level + 1, corner), (level + 1, other))
        }));
    }
    members
}

/// Two crossing diagonals per face.
fn faces(
    stack: &Stack<'_>,
    plan: &StoreysDescription,
    bottom: usize,
    top: usize,
) -> Vec<MemberDescription> {
    let diagonal = |from, to| member(stack, &plan.face_diagonal, (bottom, from), (top, to));
    sides(plan.corners_m.len())
        .flat_map(|(corner, next)| [diagonal(corner, next), diagonal(next, corner)])
        .collect()
}

/// Each corner with the next one around the polygon.
fn sides(corners: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..corners).map(move |corner| (corner, (corner + 1) % corners))
}

/// Each pair of corners that are not neighbours.
fn across(corners: usize) -> impl Iterator<Item = (usize, usize)> {
    let neighbours = move |a: usize, b: usize| b == a + 1 || (a == 0 && b == corners - 1);
    (0..corners)
        .flat_map(move |a| (a + 1..corners).map(move |b| (a, b)))
        .filter(move |&(a, b)| !neighbours(a, b))
}

fn member(
    stack: &Stack<'_>,
    section: &str,
    from: (usize, usize),
    to: (usize, usize),
) -> MemberDescription {
    let ends = [from, to].map(|(level, corner)| node_name(level, corner));
    MemberDescription {
        name: format!("{}-{}", ends[0], ends[1]),
        ends,
        section: section.to_owned(),
        module: Some(stack.module.to_owned()),
        local_y: None,
        stiffness_factor: 1.0,
    }
}
