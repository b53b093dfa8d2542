//! Materials and cross-sections.

use std::collections::BTreeMap;

use crate::check::{Check, KnownNames, Located, NumberRange};
use crate::description::{DescriptionEntry, MaterialDescription, SectionDescription, SectionKind};
use vocabulary::{MaterialName, SectionName};

/// A section with its material.
#[derive(Clone)]
pub(super) struct Section {
    pub(super) name: SectionName,
    pub(super) material_name: MaterialName,
    pub(super) shape: SectionDescription,
    pub(super) material: MaterialDescription,
}

/// The sections by index in the names.
pub(super) struct Sections {
    pub(super) names: KnownNames,
    pub(super) list: Vec<Option<Section>>,
}

pub(super) fn sections(
    check: &mut Check,
    materials: BTreeMap<String, DescriptionEntry<MaterialDescription>>,
    sections: BTreeMap<String, DescriptionEntry<SectionDescription>>,
) -> Sections {
    let mut names = KnownNames::new("material");
    let mut known = Vec::new();
    for (name, entry) in materials {
        let line = check.line(entry.offset);
        check.remember(&mut names, line, &name);
        known.push(material(check, &mut names, &name, entry));
    }
    let mut section_names = KnownNames::new("section");
    let mut list = Vec::new();
    for (name, entry) in sections {
        let line = check.line(entry.offset);
        check.remember(&mut section_names, line, &name);
        let shape = section(check, &mut section_names, &name, entry);
        list.push(shape.and_then(|Located { line, value }| {
            let user = format!("section `{name}`");
            let section_name = check.name(line, SectionName::new(name.clone()));
            let material = check.find(&names, line, &user, &value.material)?;
            let (material_name, material) = known.get(material)?.clone()?;
            Some(Section { name: section_name?, material_name, shape: value, material })
        }));
    }
    Sections { names: section_names, list }
}

fn material(
    check: &mut Check,
    names: &mut KnownNames,
    name: &str,
    mut entry: DescriptionEntry<MaterialDescription>,
) -> Option<(MaterialName, MaterialDescription)> {
    entry.name = Some(name.to_owned());
    let Located { line, value } = check.entry(names, entry)?;
    let owner = format!("material `{name}`");
    check.number(line, &owner, ("young_pa", value.young_pa), NumberRange::Within(1e3, 1e13, "Pa"));
    check.number(line, &owner, ("poisson", value.poisson), NumberRange::Poisson);
    let density = ("density_kg_per_m3", value.density_kg_per_m3);
    check.number(line, &owner, density, NumberRange::Within(0.0, 1e6, "kg/m³"));
    Some((check.name(line, MaterialName::new(name))?, value))
}

fn section(
    check: &mut Check,
    names: &mut KnownNames,
    name: &str,
    mut entry: DescriptionEntry<SectionDescription>,
) -> Option<Located<SectionDescription>> {
    entry.name = Some(name.to_owned());
    let section = check.entry(names, entry)?;
    let (line, value) = (section.line, &section.value);
    let owner = format!("section `{name}`");
    check.number(line, &owner, ("area_m2", value.area_m2), NumberRange::Within(1e-10, 1e4, "m²"));
    let moments = [
        ("second_moment_y_m4", value.second_moment_y_m4),
        ("second_moment_z_m4", value.second_moment_z_m4),
        ("torsion_constant_m4", value.torsion_constant_m4),
    ];
    for (quantity, moment) in moments {
        match (value.kind, moment) {
            (_, Some(moment)) => check.number(
                line,
                &owner,
                (quantity, moment),
                NumberRange::Within(1e-20, 1e8, "m⁴"),
            ),
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
