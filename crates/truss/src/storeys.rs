//! Determines the form of a description, explicit or with `[storeys]`, and generates its lists.

use crate::check::{Check, KnownNames, Located, NumberRange};
use crate::description::{
    DescriptionEntry, MemberDescription, ModuleDescription, NodeDescription, StoreysDescription,
};
use crate::generator::{self, Stack};

/// Tallest tower that the generator builds, in storeys.
const MOST_STOREYS: usize = 500;
/// Most corners of a plan.
const MOST_CORNERS: usize = 32;

/// The lists of a description as in the file.
pub(crate) struct Lists {
    pub(crate) storeys: Option<DescriptionEntry<StoreysDescription>>,
    pub(crate) nodes: Vec<DescriptionEntry<NodeDescription>>,
    pub(crate) members: Vec<DescriptionEntry<MemberDescription>>,
    pub(crate) node_names: KnownNames,
    pub(crate) member_names: KnownNames,
}

type WrittenOut = (Vec<Located<NodeDescription>>, Vec<Located<MemberDescription>>);

/// The nodes and members of a description, generated if necessary.
pub(crate) fn write_out(
    check: &mut Check,
    lists: &mut Lists,
    modules: &[Located<ModuleDescription>],
) -> WrittenOut {
    match lists.storeys.take() {
        Some(storeys) => {
            let line = check.line(storeys.offset);
            if !lists.nodes.is_empty() || !lists.members.is_empty() {
                check.form(line, "`[storeys]` makes the nodes and members; leave out either it or the lists `nodes` and `members`".to_owned());
            }
            let mut names = KnownNames::new("`[storeys]`");
            let plan = check.entry(&mut names, storeys);
            plan.map_or_else(Default::default, |plan| generate(check, &plan, modules))
        }
        None => explicit(check, lists, modules),
    }
}

fn explicit(
    check: &mut Check,
    lists: &mut Lists,
    modules: &[Located<ModuleDescription>],
) -> WrittenOut {
    for module in modules {
        if module.value.storeys.is_some() || module.value.column.is_some() {
            check.form(module.line, format!("module `{}` has `storeys` or `column`, which are for the generator; add a table `[storeys]` or list the members", module.value.name));
        }
    }
    let nodes = std::mem::take(&mut lists.nodes);
    let nodes = nodes.into_iter().filter_map(|e| check.entry(&mut lists.node_names, e)).collect();
    let members = std::mem::take(&mut lists.members);
    let members =
        members.into_iter().filter_map(|e| check.entry(&mut lists.member_names, e)).collect();
    (nodes, members)
}

fn generate(
    check: &mut Check,
    plan: &Located<StoreysDescription>,
    modules: &[Located<ModuleDescription>],
) -> WrittenOut {
    let mistakes = check.errors.len();
    check_plan(check, plan);
    let stacks: Vec<_> = modules.iter().filter_map(|module| stack(check, module)).collect();
    let storeys: usize = stacks.iter().map(|stack| stack.storeys).fold(0, usize::saturating_add);
    if storeys > MOST_STOREYS {
        check.form(
            plan.line,
            format!("the modules have {storeys} storeys together; use at most {MOST_STOREYS}"),
        );
    }
    if check.errors.len() > mistakes {
        return Default::default();
    }
    let line = plan.line;
    let nodes = generator::nodes(storeys, &plan.value);
    let members = generator::members(&stacks, &plan.value);
    (
        nodes.into_iter().map(|value| Located { line, value }).collect(),
        members.into_iter().map(|value| Located { line, value }).collect(),
    )
}

fn check_plan(check: &mut Check, Located { line, value }: &Located<StoreysDescription>) {
    let owner = "`[storeys]`";
    check.number(*line, owner, ("height_m", value.height_m), NumberRange::Within(1e-6, 1e6, "m"));
    check.number(*line, owner, ("mass_kg", value.mass_kg), NumberRange::NotNegative);
    for coordinate in value.corners_m.iter().flatten() {
        check.number(*line, owner, ("corners_m", *coordinate), NumberRange::Finite);
    }
    if !(3..=MOST_CORNERS).contains(&value.corners_m.len()) {
        check.form(
            *line,
            format!(
                "`corners_m` of {owner} has {} corners; use 3 to {MOST_CORNERS}",
                value.corners_m.len()
            ),
        );
    }
}

fn stack<'a>(check: &mut Check, module: &'a Located<ModuleDescription>) -> Option<Stack<'a>> {
    let Located { line, value } = module;
    if value.lower_interface.is_some() {
        check.form(*line, format!("module `{}` has `lower_interface`, which `[storeys]` determines by itself; leave it out", value.name));
    }
    let storeys = value.storeys.filter(|&storeys| storeys > 0);
    if storeys.is_none() {
        check.form(
            *line,
            format!("module `{}` lacks `storeys`; state how many it has, at least 1", value.name),
        );
    }
    if value.column.is_none() {
        check.form(
            *line,
            format!("module `{}` lacks `column`; name the section of its columns", value.name),
        );
    }
    Some(Stack { module: &value.name, storeys: storeys?, column: value.column.as_deref()? })
}
