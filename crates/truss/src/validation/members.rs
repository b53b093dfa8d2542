//! Members: ends, sections, position in space.

use super::sections::{Section, Sections};
use crate::check::{Check, KnownNames, Located, NumberRange};
use crate::description::{MemberDescription, SectionKind};
use crate::description_error::DescriptionProblem;
use crate::element::cross;
use crate::member::{Member, MemberKind};
use crate::structure::Node;
use vocabulary::MemberName;

/// Ends closer than this are at the same position \[m\].
const SHORTEST_M: f64 = 1e-6;
/// A vector with less than this share perpendicular to a member is considered parallel to it.
const ALONG: f64 = 1e-6;
/// Tolerance for the length of a unit vector.
const ROUNDING: f64 = 1e-14;

/// A member and the module it belongs to, if known.
pub(super) struct PlacedMember {
    pub(super) member: Option<Member>,
    pub(super) ends: [Option<usize>; 2],
    pub(super) module: Option<usize>,
}

pub(super) struct MemberContext<'a> {
    pub(super) sections: &'a Sections,
    pub(super) nodes: &'a [Option<Node>],
    pub(super) node_names: &'a KnownNames,
    pub(super) module_names: &'a KnownNames,
}

pub(super) fn placed_member(
    check: &mut Check,
    names: &mut KnownNames,
    Located { line, value }: Located<MemberDescription>,
    context: &MemberContext<'_>,
) -> PlacedMember {
    check.remember(names, line, &value.name);
    let user = format!("member `{}`", value.name);
    let ends = [0, 1].map(|end| check.find(context.node_names, line, &user, &value.ends[end]));
    let module = member_module(check, line, &user, value.module.as_deref(), context);
    let member = member(check, line, value, ends, context);
    PlacedMember { member, ends, module }
}

fn member_module(
    check: &mut Check,
    line: usize,
    user: &str,
    named: Option<&str>,
    context: &MemberContext<'_>,
) -> Option<usize> {
    match (named, context.module_names.names().len()) {
        (Some(name), _) => check.find(context.module_names, line, user, name),
        (None, 0) => None,
        (None, 1) => Some(0),
        (None, _) => {
            check.form(
                line,
                format!("{user} does not say which module it belongs to; add `module = \"…\"`"),
            );
            None
        }
    }
}

fn member(
    check: &mut Check,
    line: usize,
    value: MemberDescription,
    ends: [Option<usize>; 2],
    context: &MemberContext<'_>,
) -> Option<Member> {
    let owner = format!("member `{}`", value.name);
    check.number(
        line,
        &owner,
        ("stiffness_factor", value.stiffness_factor),
        NumberRange::Within(1e-9, 1e9, ""),
    );
    let name = check.name(line, MemberName::new(value.name.clone()));
    let section = check.find(&context.sections.names, line, &owner, &value.section);
    let (length_m, axis) = span(check, line, &value, ends, context)?;
    let Section { name: section, material_name, shape, material } =
        context.sections.list.get(section?)?.clone()?;
    let kind = match shape.kind {
        SectionKind::Rod => MemberKind::Rod,
        SectionKind::Beam => MemberKind::Beam {
            second_moment_y_m4: shape.second_moment_y_m4?,
            second_moment_z_m4: shape.second_moment_z_m4?,
            torsion_constant_m4: shape.torsion_constant_m4?,
            local_y: local_y(check, line, &owner, value.local_y, axis)?,
        },
    };
    Some(Member {
        name: name?,
        kind,
        section,
        material: material_name,
        ends: [ends[0]?, ends[1]?],
        length_m,
        axis,
        area_m2: shape.area_m2,
        young_pa: material.young_pa,
        poisson: material.poisson,
        density_kg_per_m3: material.density_kg_per_m3,
        stiffness_factor: value.stiffness_factor,
    })
}

/// Length and direction of a member; `None` for a length of 0, which is reported.
fn span(
    check: &mut Check,
    line: usize,
    value: &MemberDescription,
    [from, to]: [Option<usize>; 2],
    context: &MemberContext<'_>,
) -> Option<(f64, [f64; 3])> {
    let position = |node: usize| context.nodes.get(node)?.as_ref().map(|node| node.position_m);
    let (from, to) = (position(from?)?, position(to?)?);
    if !from.iter().chain(&to).all(|coordinate| coordinate.is_finite()) {
        return None;
    }
    let span = length_and_axis(from, to);
    if span.is_none() {
        report_zero_length(check, line, "member", &value.name, &value.ends);
    }
    span
}

pub(super) fn length_and_axis(from: [f64; 3], to: [f64; 3]) -> Option<(f64, [f64; 3])> {
    let along: [f64; 3] = std::array::from_fn(|i| to[i] - from[i]);
    let length = norm(along);
    (length >= SHORTEST_M).then(|| (length, along.map(|x| x / length)))
}

fn norm(vector: [f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

pub(super) fn report_zero_length(
    check: &mut Check,
    line: usize,
    what: &'static str,
    name: &str,
    ends: &[String; 2],
) {
    let [from, to] = ends.clone();
    check.report(
        Some(line),
        DescriptionProblem::ZeroLength { what, name: name.to_owned(), from, to },
    );
}

/// The local y axis: the component of the given vector perpendicular to the member or, by default, the horizontal one
/// (the global y axis for a vertical member).
fn local_y(
    check: &mut Check,
    line: usize,
    owner: &str,
    given: Option<[f64; 3]>,
    axis: [f64; 3],
) -> Option<[f64; 3]> {
    let horizontal = cross([0.0, 0.0, 1.0], axis);
    let wanted = match given {
        Some(vector) => vector,
        None if norm(horizontal) < ALONG => [0.0, 1.0, 0.0],
        None => horizontal,
    };
    // A vector that is already perpendicular and of unit length is kept to the last bit.
    if is_square_to(wanted, axis) {
        return Some(wanted);
    }
    let Some(across) = made_square(wanted, axis) else {
        check.form(
            line,
            format!("`local_y` of {owner} runs along the member; give a vector across it"),
        );
        return None;
    };
    // A vector almost parallel to the member becomes perpendicular only after a second pass. It must be exact, because
    // otherwise reading it back from a written file would give a different vector.
    if is_square_to(across, axis) { Some(across) } else { made_square(across, axis) }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn is_square_to(vector: [f64; 3], axis: [f64; 3]) -> bool {
    dot(vector, axis).abs() < ROUNDING && (norm(vector) - 1.0).abs() < ROUNDING
}

/// The component of a vector perpendicular to the axis, with unit length; `None` if it almost vanishes.
fn made_square(vector: [f64; 3], axis: [f64; 3]) -> Option<[f64; 3]> {
    let along = dot(vector, axis);
    let across: [f64; 3] = std::array::from_fn(|i| vector[i] - along * axis[i]);
    let size = norm(across);
    (size.is_finite() && size > ALONG * norm(vector)).then(|| across.map(|x| x / size))
}
