//! Why a verdict is what it is.

use diagnosis::Rule;
use truss::ids::{Component, Step};

use super::account::{Account, Changed, Root};
use super::words::{counted, list, times};

/// Most rivals that are named.
const SHOWN: usize = 3;

/// Why the component that changed was named.
pub(super) fn of_fault(account: &Account, changed: &Changed) -> String {
    match (rule(account, changed), &changed.component.component) {
        (Rule::Paper, Component::Actuator(_)) => {
            "by the paper's rule an actuator that changes is faulty itself".to_owned()
        }
        (Rule::Paper, Component::Sensor(_)) => {
            "no actuator is held for faulty anywhere, so by the paper's rule the gage itself is"
                .to_owned()
        }
        (Rule::FirstChange, _) => of_root(account, changed),
    }
}

/// Why the change is explained by the root.
pub(super) fn of_explanation(account: &Account, changed: &Changed, root: &Root) -> String {
    let clock = account.clock();
    let Root { component, step } = root;
    if rule(account, changed) == Rule::Paper {
        let since = clock.time(*step);
        return format!(
            "{component} is held for faulty since {since}, which by the paper's rule explains every \
             gage's changes"
        );
    }
    let order = order(account, changed.step, *step);
    let root = account.change(component, *step);
    match root.filter(|root| is_tie(account, root, changed)) {
        Some(root) => {
            let (own, its) = (times(changed.peak), times(root.peak));
            format!(
                "{component} {order}: a tie, and it rose to {its} its threshold, this one to {own}"
            )
        }
        None => format!("{component} {order}"),
    }
}

/// `changed 14 ms earlier`
fn order(account: &Account, change: Step, root: Step) -> String {
    let clock = account.clock();
    match change.cmp(&root) {
        std::cmp::Ordering::Greater => {
            format!("changed {} earlier", clock.span(change.since(root)))
        }
        std::cmp::Ordering::Equal => "changed in the same step".to_owned(),
        std::cmp::Ordering::Less => format!("changed {} later", clock.span(root.since(change))),
    }
}

fn of_root(account: &Account, changed: &Changed) -> String {
    let clock = account.clock();
    let (first, previous) = group(account, changed);
    let tie = tie(account, changed);
    let rivals: Vec<&Changed> = (account.changes.iter())
        .filter(|c| (first..=first.plus(tie)).contains(&c.step))
        .filter(|c| c.component != changed.component)
        .collect();
    let before = match previous {
        Some(end) if first == end.plus(1) && changed.peak >= leap(account, changed) => {
            let (peak, tie) = (times(changed.peak), clock.span(tie));
            return format!("it leapt to {peak} its threshold within {tie}, which no effect does");
        }
        None => "no channel of the structure had changed before".to_owned(),
        Some(end) => {
            format!("the changes before are past, they explain nothing after {}", clock.time(end))
        }
    };
    if rivals.is_empty() {
        return format!("{before}, so this first change names the fault");
    }
    let others: Vec<String> =
        rivals.iter().map(|c| format!("{} {}", c.component, times(c.peak))).collect();
    format!(
        "a tie with {} within {}: it rose highest, to {} its threshold ({})",
        counted(rivals.len(), "other change"),
        clock.span(tie),
        times(changed.peak),
        list(&others, SHOWN)
    )
}

/// The first step of the group of changes that this one belongs to, and the last step that the group
/// before it covered.
fn group(account: &Account, changed: &Changed) -> (Step, Option<Step>) {
    let Some(settings) = account.isolation(&changed.component.module) else {
        return (changed.step, None);
    };
    let mut rest = &account.changes[..];
    let mut previous = None;
    while let Some(first) = rest.first().map(|change| change.step) {
        let tie = first.plus(settings.tie_steps);
        let rivals = rest.iter().take_while(|change| change.step <= tie);
        let root = rivals.max_by(|a, b| a.peak.total_cmp(&b.peak)).map(|root| &root.component);
        let mut leaps = rest.iter().filter(|c| c.step > tie && c.peak >= settings.leap_ratio);
        let leap = leaps.find(|leap| Some(&leap.component) != root);
        let horizon = first.plus(settings.horizon_steps);
        let end = leap.map_or(horizon, |leap| horizon.min(leap.step.minus(1)));
        if changed.step <= end {
            return (first, previous);
        }
        previous = Some(end);
        rest = &rest[rest.partition_point(|change| change.step <= end)..];
    }
    (changed.step, previous)
}

/// Did the ratios decide between the root and the change?
pub(super) fn is_tie(account: &Account, root: &Changed, changed: &Changed) -> bool {
    let (first, _) = group(account, changed);
    let within = first..=first.plus(tie(account, changed));
    rule(account, changed) == Rule::FirstChange
        && within.contains(&changed.step)
        && within.contains(&root.step)
}

fn rule(account: &Account, changed: &Changed) -> Rule {
    account.isolation(&changed.component.module).map_or(Rule::default(), |i| i.rule)
}

fn tie(account: &Account, changed: &Changed) -> u64 {
    account.isolation(&changed.component.module).map_or(0, |isolation| isolation.tie_steps)
}

fn leap(account: &Account, changed: &Changed) -> f64 {
    let isolation = account.isolation(&changed.component.module);
    isolation.map_or(f64::INFINITY, |isolation| isolation.leap_ratio)
}
