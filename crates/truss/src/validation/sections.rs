//! Materials and cross-sections.

use std::collections::BTreeMap;

use crate::check::{Check, Located, Range, Register};
use crate::description::{Entry, MaterialDescription, SectionDescription, SectionKind};
use vocabulary::{MaterialName, SectionName};

/// A section with its material.
#[derive(Clone)]
pub(super) struct Section {
    pub(super) name: SectionName,
    pub(super) material_name: MaterialName,
    pub(super) shape: SectionDescription,
    pub(super) material: MaterialDescription,
}

/// The sections by index in the register.
pub(super) struct Sections {
    pub(super) register: Register,
    pub(super) list: Vec<Option<Section>>,
}

pub(super) fn sections(
    check: &mut Check,
    materials: BTreeMap<String, Entry<MaterialDescription>>,
    sections: BTreeMap<String, Entry<SectionDescription>>,
) -> Sections {
    let mut register = Register::new("material");
    let mut known = Vec::new();
    for (name, entry) in materials {
        let line = check.line(entry.offset);
        check.register(&mut register, line, &name);
        known.push(material(check, &mut register, &name, entry));
    }
    let mut section_register = Register::new("section");
    let mut list = Vec::new();
    for (name, entry) in sections {
        let line = check.line(entry.offset);
        check.register(&mut section_register, line, &name);
        let shape = section(check, &mut section_register, &name, entry);
        list.push(shape.and_then(|Located { line, value }| {
            let user = format!("section `{name}`");
            let section_name = check.name(line, SectionName::new(name.clone()));
            let material = check.find(&register, line, &user, &value.material)?;
            let (material_name, material) = known.get(material)?.clone()?;
            Some(Section { name: section_name?, material_name, shape: value, material })
        }));
    }
    Sections { register: section_register, list }
}

fn material(
    check: &mut Check,
    register: &mut Register,
    name: &str,
    mut entry: Entry<MaterialDescription>,
) -> Option<(MaterialName, MaterialDescription)> {
    entry.name = Some(name.to_owned());
    let Located { line, value } = check.entry(register, entry)?;
    let owner = format!("material `{name}`");
    check.number(line, &owner, ("young_pa", value.young_pa), Range::Positive);
    check.number(line, &owner, ("poisson", value.poisson), Range::Poisson);
    let density = ("density_kg_per_m3", value.density_kg_per_m3);
    check.number(line, &owner, density, Range::NotNegative);
    Some((check.name(line, MaterialName::new(name))?, value))
}

fn section(
    check: &mut Check,
    register: &mut Register,
    name: &str,
    mut entry: Entry<SectionDescription>,
) -> Option<Located<SectionDescription>> {
    entry.name = Some(name.to_owned());
    let section = check.entry(register, entry)?;
    let (line, value) = (section.line, &section.value);
    let owner = format!("section `{name}`");
    check.number(line, &owner, ("area_m2", value.area_m2), Range::Positive);
    let moments = [
        ("second_moment_y_m4", value.second_moment_y_m4),
        ("second_moment_z_m4", value.second_moment_z_m4),
        ("torsion_constant_m4", value.torsion_constant_m4),
    ];
    for (quantity, moment) in moments {
        match (value.kind, moment) {
            (_, Some(moment)) => check.number(line, &owner, (quantity, moment), Range::Positive),
            (SectionKind::Rod, None) => {}
            (SectionKind::Beam, None) => {
                check.form(
                    line,
                    format!(
                        "{owner} is a beam and lacks `{quantity}`; state it, or use kind `rod`"
                    ),
                );
            }
        }
    }
    Some(section)
}
