//! Writes a structure as TOML in explicit form, one node, member, actuator or gage a line.

use std::collections::BTreeMap;
use std::fmt::{self, Write};

use crate::member::{Member, MemberKind};
use crate::structure::{Actuator, Module, Node, Structure};
use crate::surroundings::Surroundings;

impl Structure {
    /// The description in explicit form: every node and member on a line. Reading it yields the same structure.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        // Writing to a `String` cannot fail.
        let _ = write_all(&mut text, self);
        text
    }
}

fn write_all(out: &mut String, structure: &Structure) -> fmt::Result {
    writeln!(out, "name = \"{}\"", structure.name)?;
    writeln!(out, "\nnodes = [")?;
    for node in &structure.nodes {
        write_node(out, node)?;
    }
    writeln!(out, "]\n\nmembers = [")?;
    for (member, owner) in structure.members.iter().zip(owners(structure)) {
        write_member(out, structure, member, owner)?;
    }
    writeln!(out, "]\n\n[damping]")?;
    writeln!(out, "alpha_per_s = {:?}", structure.damping.alpha_per_s)?;
    writeln!(out, "beta_s = {:?}", structure.damping.beta_s)?;
    write_materials(out, structure)?;
    write_sections(out, structure)?;
    for module in &structure.modules {
        write_module(out, structure, module)?;
    }
    structure.surroundings.iter().try_for_each(|known| write_surroundings(out, structure, known))
}

fn write_surroundings(
    out: &mut String,
    structure: &Structure,
    known: &Surroundings,
) -> fmt::Result {
    writeln!(
        out,
        "\n# The stiffness of the rest of the structure between nodes that it shares with this part: lower"
    )?;
    writeln!(out, "# triangle, row by row [N/m, N, N m].\n[[surroundings]]\nfreedoms = [")?;
    for dof in &known.freedoms {
        writeln!(out, "  [\"{}\", \"{}\"],", structure.nodes[dof.node].name, dof.direction)?;
    }
    writeln!(out, "]\nstiffness = [")?;
    for row in 0..known.freedoms.len() {
        let values: Vec<_> = (0..=row).map(|column| known.stiffness[(row, column)]).collect();
        writeln!(out, "  {values:?},")?;
    }
    writeln!(out, "]")
}

fn write_node(out: &mut String, node: &Node) -> fmt::Result {
    write!(out, "  {{ name = \"{}\", position_m = {:?}", node.name, node.position_m)?;
    if node.mass_kg != 0.0 {
        write!(out, ", mass_kg = {:?}", node.mass_kg)?;
    }
    if node.mass_factor != 1.0 {
        write!(out, ", mass_factor = {:?}", node.mass_factor)?;
    }
    if node.support.is_any() {
        let fixed = quoted(node.support.directions());
        write!(out, ", fixed = [{fixed}]")?;
    }
    writeln!(out, " }},")
}

/// The module of each member.
fn owners(structure: &Structure) -> Vec<Option<&Module>> {
    let mut owners = vec![None; structure.members.len()];
    for module in &structure.modules {
        for &member in &module.members {
            owners[member] = Some(module);
        }
    }
    owners
}

fn write_member(
    out: &mut String,
    structure: &Structure,
    member: &Member,
    owner: Option<&Module>,
) -> fmt::Result {
    let ends = quoted(member.ends.map(|end| &structure.nodes[end].name));
    write!(out, "  {{ name = \"{}\", ends = [{ends}]", member.name)?;
    write!(out, ", section = \"{}\"", member.section)?;
    if let (Some(module), 2..) = (owner, structure.modules.len()) {
        write!(out, ", module = \"{}\"", module.name)?;
    }
    if let MemberKind::Beam { local_y, .. } = member.kind {
        write!(out, ", local_y = {local_y:?}")?;
    }
    if member.stiffness_factor != 1.0 {
        write!(out, ", stiffness_factor = {:?}", member.stiffness_factor)?;
    }
    writeln!(out, " }},")
}

fn write_materials(out: &mut String, structure: &Structure) -> fmt::Result {
    let used: BTreeMap<&str, &Member> =
        structure.members.iter().map(|member| (member.material.as_str(), member)).collect();
    for (name, member) in used {
        writeln!(out, "\n[materials.{name}]")?;
        writeln!(out, "young_pa = {:?}", member.young_pa)?;
        writeln!(out, "poisson = {:?}", member.poisson)?;
        writeln!(out, "density_kg_per_m3 = {:?}", member.density_kg_per_m3)?;
    }
    Ok(())
}

fn write_sections(out: &mut String, structure: &Structure) -> fmt::Result {
    let used: BTreeMap<&str, &Member> =
        structure.members.iter().map(|member| (member.section.as_str(), member)).collect();
    for (name, member) in used {
        writeln!(out, "\n[sections.{name}]")?;
        let kind = if member.is_beam() { "beam" } else { "rod" };
        writeln!(out, "kind = \"{kind}\"")?;
        writeln!(out, "material = \"{}\"", member.material)?;
        writeln!(out, "area_m2 = {:?}", member.area_m2)?;
        if let MemberKind::Beam {
            second_moment_y_m4,
            second_moment_z_m4,
            torsion_constant_m4,
            ..
        } = member.kind
        {
            writeln!(out, "second_moment_y_m4 = {second_moment_y_m4:?}")?;
            writeln!(out, "second_moment_z_m4 = {second_moment_z_m4:?}")?;
            writeln!(out, "torsion_constant_m4 = {torsion_constant_m4:?}")?;
        }
    }
    Ok(())
}

fn write_module(out: &mut String, structure: &Structure, module: &Module) -> fmt::Result {
    writeln!(out, "\n[[modules]]\nname = \"{}\"", module.name)?;
    // If omitted, it comprises all nodes shared with earlier modules, none for the first module.
    if structure.modules.len() > 1 || !module.lower_interface.is_empty() {
        let nodes = quoted(module.lower_interface.iter().map(|&n| &structure.nodes[n].name));
        writeln!(out, "lower_interface = [{nodes}]")?;
    }
    if !module.actuators.is_empty() {
        writeln!(out, "actuators = [")?;
        for actuator in &module.actuators {
            write_actuator(out, structure, actuator)?;
        }
        writeln!(out, "]")?;
    }
    if !module.gages.is_empty() {
        writeln!(out, "gages = [")?;
        for gage in &module.gages {
            let member = &structure.gage_member(gage).name;
            writeln!(out, "  {{ name = \"{}\", member = \"{member}\" }},", gage.name)?;
        }
        writeln!(out, "]")?;
    }
    Ok(())
}

fn write_actuator(out: &mut String, structure: &Structure, actuator: &Actuator) -> fmt::Result {
    write!(out, "  {{ name = \"{}\", ", actuator.name)?;
    match actuator.member {
        Some(member) => write!(out, "member = \"{}\"", structure.members[member].name)?,
        None => {
            let ends = quoted(actuator.ends.map(|end| &structure.nodes[end].name));
            write!(out, "between = [{ends}]")?;
        }
    }
    writeln!(out, " }},")
}

/// Words in quotes with commas between them.
fn quoted<T: fmt::Display>(words: impl IntoIterator<Item = T>) -> String {
    words.into_iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}
