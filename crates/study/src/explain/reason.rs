//! The reason for a verdict.

use diagnosis::{Explanation, Reason, Rule};
use vocabulary::{Component, ComponentPath, Step};

use super::account::{Account, Changed};
use super::words::{counted, list, times};

/// Most rivals listed.
const SHOWN: usize = 3;

/// Why the component that changed was named.
pub(super) fn of_fault(account: &Account, changed: &Changed) -> String {
    match (account.rule(&changed.component.module), &changed.component.component) {
        (Rule::Paper, Component::Actuator(_)) => {
            "by the paper's rule an actuator that changes is faulty itself".to_owned()
        }
        (Rule::Paper, Component::Sensor(_)) => {
            "no actuator is declared faulty anywhere, so by the paper's rule the gage itself is"
                .to_owned()
        }
        (Rule::FirstChange, _) => of_root(account, changed),
    }
}

/// Why the change is explained by that of a component at the step `since`.
pub(super) fn of_explanation(
    account: &Account,
    changed: &Changed,
    component: &ComponentPath,
    since: Step,
) -> String {
    if account.rule(&changed.component.module) == Rule::Paper {
        let since = account.clock().time(since);
        return format!(
            "{component} was declared faulty at {since}, which by the paper's rule explains every \
             gage's changes"
        );
    }
    let order = order(account, changed.step, since);
    match (how(account, changed), account.change(component, since)) {
        (Some(Explanation::Tie), Some(root)) => {
            let (own, its) = (times(changed.peak), times(root.peak));
            format!(
                "{component} {order}: a tie, and it rose to {its} its threshold, this one to {own}"
            )
        }
        (Some(Explanation::Leaving), _) => {
            format!("{component} {order}, and the effect of that leaves the interval")
        }
        (Some(Explanation::ByEffect), _) => {
            format!("{component} {order}, and an effect of that was still changing")
        }
        _ => format!("{component} {order}"),
    }
}

/// How the change was recognised as an effect.
fn how(account: &Account, changed: &Changed) -> Option<Explanation> {
    match account.reason(changed)? {
        Reason::Effect { how, .. } => Some(how),
        Reason::First { .. } | Reason::ByRatio | Reason::Again => None,
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
    let tie = clock.span(account.tie_steps(&changed.component.module));
    let (rivals, before) = match account.reason(changed) {
        None | Some(Reason::Effect { .. }) => return "no other change explains it".to_owned(),
        Some(Reason::Again) => return "it was a root cause before".to_owned(),
        Some(Reason::ByRatio) => {
            let peak = times(changed.peak);
            return format!(
                "it rose to {peak} its threshold within {tie}, reaching the root ratio: a root \
                 cause of its own"
            );
        }
        Some(Reason::First { rivals, before }) => (rivals, before),
    };
    let before = match before {
        None => "no channel of the structure had changed before".to_owned(),
        Some(end) => format!("earlier changes explain nothing after {}", clock.time(end)),
    };
    let rivals = rivals.iter().filter(|c| c.path != changed.component);
    let others: Vec<String> = rivals.map(|c| format!("{} {}", c.path, times(c.ratio))).collect();
    if others.is_empty() {
        return format!("{before}, so this first change names the fault");
    }
    format!(
        "a tie with {} within {tie}: it rose highest, to {} its threshold ({})",
        counted(others.len(), "other change"),
        times(changed.peak),
        list(&others, SHOWN)
    )
}

/// Whether the ratios decided between the change and its root cause.
pub(super) fn is_tie(account: &Account, changed: &Changed) -> bool {
    account.rule(&changed.component.module) == Rule::FirstChange
        && how(account, changed) == Some(Explanation::Tie)
}
