//! Modules: their members, lower interfaces and equipment.

use std::collections::BTreeSet;

use super::members::{PlacedMember, length_and_axis, report_zero_length};
use crate::check::{Check, KnownNames, Located};
use crate::description::{
    ActuatorDescription, DescriptionEntry, GageDescription, ModuleDescription,
};
use crate::structure::{Actuator, Gage, Module, Node};
use vocabulary::{ActuatorName, GageName, ModuleName};

pub(super) struct ModuleContext<'a> {
    pub(super) nodes: &'a [Option<Node>],
    pub(super) node_names: &'a KnownNames,
    pub(super) members: &'a [PlacedMember],
    pub(super) member_names: &'a KnownNames,
}

pub(super) fn module(
    check: &mut Check,
    index: usize,
    Located { line, value }: Located<ModuleDescription>,
    context: &ModuleContext<'_>,
) -> Option<Module> {
    let name = check.name(line, ModuleName::new(value.name.clone()));
    let owner = format!("module `{}`", value.name);
    let own = |member: &PlacedMember| member.module == Some(index);
    let members: Vec<usize> =
        (0..context.members.len()).filter(|&m| context.members.get(m).is_some_and(own)).collect();
    if members.is_empty() {
        check.form(
            line,
            format!("{owner} has no members; let some say `module = \"{}\"`", value.name),
        );
    }
    let touched: BTreeSet<usize> =
        context.members.iter().filter(|m| own(m)).flat_map(|m| m.ends).flatten().collect();
    let interface = lower_interface(check, line, &value, index, &touched, context);
    let own = Own { owner: &owner, index, nodes: &touched, context };
    let mut names = KnownNames::new("actuator");
    let actuators: Vec<_> =
        value.actuators.into_iter().map(|entry| actuator(check, &mut names, entry, &own)).collect();
    let mut names = KnownNames::new("gage");
    let gages: Vec<_> =
        value.gages.into_iter().map(|entry| gage(check, &mut names, entry, &own)).collect();
    Some(Module {
        name: name?,
        nodes: touched.into_iter().collect(),
        members,
        lower_interface: interface.into_iter().collect(),
        actuators: actuators.into_iter().collect::<Option<_>>()?,
        gages: gages.into_iter().collect::<Option<_>>()?,
    })
}

/// The nodes on which a module stands: those named or, by default, those shared with earlier modules.
fn lower_interface(
    check: &mut Check,
    line: usize,
    value: &ModuleDescription,
    index: usize,
    touched: &BTreeSet<usize>,
    context: &ModuleContext<'_>,
) -> BTreeSet<usize> {
    let owner = format!("module `{}`", value.name);
    let Some(named) = &value.lower_interface else {
        let below = |member: &&PlacedMember| member.module.is_some_and(|module| module < index);
        let nodes = context.members.iter().filter(below).flat_map(|m| m.ends).flatten();
        return nodes.filter(|node| touched.contains(node)).collect();
    };
    let mut interface = BTreeSet::new();
    for name in named {
        let node = check.find(context.node_names, line, &owner, name);
        if node.is_some_and(|node| !touched.contains(&node)) {
            check.form(line, format!("{owner} stands on node `{name}`, which none of its members touches; name one of its own nodes"));
        }
        interface.extend(node);
    }
    interface
}

/// The entries that belong to a module.
struct Own<'a> {
    owner: &'a str,
    index: usize,
    nodes: &'a BTreeSet<usize>,
    context: &'a ModuleContext<'a>,
}

fn actuator(
    check: &mut Check,
    names: &mut KnownNames,
    entry: DescriptionEntry<ActuatorDescription>,
    own: &Own<'_>,
) -> Option<Actuator> {
    let Located { line, value } = check.entry(names, entry)?;
    check.remember(names, line, &value.name);
    let name = check.name(line, ActuatorName::new(value.name.clone()));
    let user = format!("actuator `{}` of {}", value.name, own.owner);
    match (value.between, value.member) {
        (Some(between), None) => {
            let ends = actuator_ends(check, line, &user, &value.name, &between, own)?;
            Some(Actuator { name: name?, ends, member: None })
        }
        (None, Some(member)) => {
            let member = own_member(check, line, &user, &member, own)?;
            let ends = own.context.members.get(member)?.ends;
            Some(Actuator { name: name?, ends: [ends[0]?, ends[1]?], member: Some(member) })
        }
        _ => {
            check.form(line, format!("{user} must say where it is; write either `between = [\"…\", \"…\"]` with two nodes or `member = \"…\"`"));
            None
        }
    }
}

fn actuator_ends(
    check: &mut Check,
    line: usize,
    user: &str,
    name: &str,
    between: &[String; 2],
    own: &Own<'_>,
) -> Option<[usize; 2]> {
    let [from, to] = [0, 1].map(|end| own_node(check, line, user, &between[end], own));
    let ends = [from?, to?];
    let position = |node: usize| own.context.nodes.get(node)?.as_ref().map(|node| node.position_m);
    if length_and_axis(position(ends[0])?, position(ends[1])?).is_none() {
        report_zero_length(check, line, "actuator", name, between);
    }
    Some(ends)
}

fn own_node(
    check: &mut Check,
    line: usize,
    user: &str,
    name: &str,
    own: &Own<'_>,
) -> Option<usize> {
    let node = check.find(own.context.node_names, line, user, name)?;
    if !own.nodes.contains(&node) {
        check.form(line, format!("{user} acts on node `{name}`, which belongs to another module; use a node of its own module"));
        return None;
    }
    Some(node)
}

fn own_member(
    check: &mut Check,
    line: usize,
    user: &str,
    name: &str,
    own: &Own<'_>,
) -> Option<usize> {
    let member = check.find(own.context.member_names, line, user, name)?;
    let module = own.context.members.get(member)?.module?;
    if module != own.index {
        check.form(line, format!("{user} sits on member `{name}`, which belongs to another module; use a member of its own module"));
        return None;
    }
    Some(member)
}

fn gage(
    check: &mut Check,
    names: &mut KnownNames,
    entry: DescriptionEntry<GageDescription>,
    own: &Own<'_>,
) -> Option<Gage> {
    let Located { line, value } = check.entry(names, entry)?;
    check.remember(names, line, &value.name);
    let user = format!("gage `{}` of {}", value.name, own.owner);
    let name = check.name(line, GageName::new(value.name));
    let member = own_member(check, line, &user, &value.member, own)?;
    Some(Gage { name: name?, member })
}
