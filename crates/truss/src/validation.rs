//! Converts a description to a [`Structure`], collecting all errors.
//!
//! An invalid entry is kept as a gap (`None`) so that the other checks continue; only a description without errors
//! becomes a structure.

mod members;
mod modules;
mod sections;

use std::collections::BTreeSet;

use nalgebra::DMatrix;

use self::members::{MemberContext, PlacedMember, placed_member};
use self::modules::{ModuleContext, module};
use self::sections::sections;
use crate::assembly::Dof;
use crate::check::{Check, KnownNames, Located, NumberRange};
use crate::description::{
    DampingDescription, Description, NodeDescription, SurroundingsDescription, complaint,
};
use crate::description_error::{DescriptionError, DescriptionErrors, DescriptionProblem};
use crate::member::Member;
use crate::storeys::{Lists, write_out};
use crate::structure::{Module, Node, Rayleigh, Structure};
use crate::surroundings::Surroundings;
use vocabulary::{NodeName, StructureName};

impl Structure {
    /// Reads and checks a description in TOML.
    ///
    /// # Errors
    /// Every mistake in the text, with its line where that is known.
    pub fn from_toml(text: &str) -> Result<Structure, DescriptionErrors> {
        read(text)
    }
}

fn read(text: &str) -> Result<Structure, DescriptionErrors> {
    let mut check = Check::new(text);
    let description: Description = toml::from_str(text).map_err(|error| {
        let line = error.span().map(|span| check.line(span.start));
        let problem = DescriptionProblem::Format(complaint(&error));
        DescriptionErrors(vec![DescriptionError { line, problem }])
    })?;
    let structure = structure(&mut check, description);
    match structure {
        Some(structure) if check.errors.is_empty() => Ok(structure),
        _ => {
            check.errors.sort_by_key(|error| error.line);
            Err(DescriptionErrors(check.errors))
        }
    }
}

fn structure(check: &mut Check, description: Description) -> Option<Structure> {
    let name_line = check.line(description.name.span().start);
    let name = check.name(name_line, StructureName::new(description.name.into_inner()));
    let damping_line = check.line(description.damping.span().start);
    let damping = damping(check, damping_line, description.damping.into_inner());
    let sections = sections(check, description.materials, description.sections);

    let mut module_names = KnownNames::new("module");
    let mut module_entries = Vec::new();
    for module in description.modules {
        let line = check.line(module.span().start);
        check.remember(&mut module_names, line, &module.get_ref().name);
        module_entries.push(Located { line, value: module.into_inner() });
    }
    if module_entries.is_empty() {
        let message = "no module is defined; add at least one `[[modules]]`".to_owned();
        check.report(None, DescriptionProblem::Form(message));
    }

    let mut lists = Lists {
        storeys: description.storeys,
        nodes: description.nodes,
        members: description.members,
        node_names: KnownNames::new("node"),
        member_names: KnownNames::new("member"),
    };
    let (node_entries, member_entries) = write_out(check, &mut lists, &module_entries);
    let Lists { mut node_names, mut member_names, .. } = lists;
    let node_lines: Vec<usize> = node_entries.iter().map(|entry| entry.line).collect();
    let nodes: Vec<Option<Node>> =
        node_entries.into_iter().map(|entry| node(check, &mut node_names, entry)).collect();
    let context = MemberContext {
        sections: &sections,
        nodes: &nodes,
        node_names: &node_names,
        module_names: &module_names,
    };
    let members: Vec<PlacedMember> = member_entries
        .into_iter()
        .map(|entry| placed_member(check, &mut member_names, entry, &context))
        .collect();
    let context = ModuleContext {
        nodes: &nodes,
        node_names: &node_names,
        members: &members,
        member_names: &member_names,
    };
    let modules: Vec<Option<Module>> = module_entries
        .into_iter()
        .enumerate()
        .map(|(index, entry)| module(check, index, entry, &context))
        .collect();
    let surroundings: Vec<Option<Surroundings>> = (description.surroundings.into_iter())
        .map(|entry| {
            let line = check.line(entry.span().start);
            surroundings(check, line, entry.into_inner(), &node_names, &members)
        })
        .collect();
    // While a member is invalid, a node without members may only seem unused.
    if !member_names.is_broken() && members.iter().all(|placed| placed.member.is_some()) {
        report_idle_nodes(check, &node_lines, &nodes, &members);
    }
    Some(Structure {
        name: name?,
        damping,
        nodes: nodes.into_iter().collect::<Option<_>>()?,
        members: members.into_iter().map(|placed| placed.member).collect::<Option<_>>()?,
        modules: modules.into_iter().collect::<Option<_>>()?,
        surroundings: surroundings.into_iter().collect::<Option<_>>()?,
    })
}

/// What the rest of a larger structure does to the nodes.
fn surroundings(
    check: &mut Check,
    line: usize,
    SurroundingsDescription { freedoms, stiffness }: SurroundingsDescription,
    nodes: &KnownNames,
    members: &[PlacedMember],
) -> Option<Surroundings> {
    let owner = "`surroundings`";
    let beams = members.iter().filter(|m| m.member.as_ref().is_some_and(Member::is_beam));
    let turning: BTreeSet<usize> = beams.flat_map(|beam| beam.ends).flatten().collect();
    let mut known = Vec::with_capacity(freedoms.len());
    for (name, direction) in &freedoms {
        let Some(node) = check.find(nodes, line, owner, name) else { continue };
        let dof = Dof { node, direction: *direction };
        if known.contains(&dof) {
            check.form(
                line,
                format!("{owner} names {direction} of node `{name}` twice; name it once"),
            );
        }
        if direction.is_rotation() && !turning.contains(&node) {
            check.form(
                line,
                format!(
                    "{owner} names {direction} of node `{name}`, which no beam turns; leave it out"
                ),
            );
        }
        known.push(dof);
    }
    let is_triangle = stiffness.len() == freedoms.len()
        && stiffness.iter().enumerate().all(|(row, values)| values.len() == row + 1);
    if !is_triangle {
        let count = freedoms.len();
        check.form(line, format!("the stiffness of {owner} is no lower triangle of {count} rows; give row k its first k values"));
        return None;
    }
    for value in stiffness.iter().flatten() {
        check.number(line, owner, ("stiffness", *value), NumberRange::Finite);
    }
    let size = (known.len() == freedoms.len()).then_some(freedoms.len())?;
    let stiffness = DMatrix::from_fn(size, size, |i, j| stiffness[i.max(j)][i.min(j)]);
    Some(Surroundings { freedoms: known, stiffness })
}

fn damping(check: &mut Check, line: usize, damping: DampingDescription) -> Rayleigh {
    let owner = "the damping";
    check.number(line, owner, ("alpha_per_s", damping.alpha_per_s), NumberRange::NotNegative);
    check.number(line, owner, ("beta_s", damping.beta_s), NumberRange::NotNegative);
    Rayleigh { alpha_per_s: damping.alpha_per_s, beta_s: damping.beta_s }
}

fn node(
    check: &mut Check,
    names: &mut KnownNames,
    Located { line, value }: Located<NodeDescription>,
) -> Option<Node> {
    check.remember(names, line, &value.name);
    let owner = format!("node `{}`", value.name);
    for coordinate in value.position_m {
        check.number(line, &owner, ("position_m", coordinate), NumberRange::Finite);
    }
    check.number(line, &owner, ("mass_kg", value.mass_kg), NumberRange::NotNegative);
    check.number(
        line,
        &owner,
        ("mass_factor", value.mass_factor),
        NumberRange::Within(1e-9, 1e9, ""),
    );
    Some(Node {
        name: check.name(line, NodeName::new(value.name))?,
        position_m: value.position_m,
        mass_kg: value.mass_kg,
        mass_factor: value.mass_factor,
        support: value.fixed.into_iter().collect(),
    })
}

/// Reports nodes without members, which nothing supports.
fn report_idle_nodes(
    check: &mut Check,
    lines: &[usize],
    nodes: &[Option<Node>],
    members: &[PlacedMember],
) {
    let touched: BTreeSet<usize> = members.iter().flat_map(|m| m.ends).flatten().collect();
    for (index, (node, &line)) in nodes.iter().zip(lines).enumerate() {
        if let (false, Some(node)) = (touched.contains(&index), node) {
            let name = &node.name;
            check.form(
                line,
                format!("node `{name}` belongs to no member; connect it or leave it out"),
            );
        }
    }
}
