//! The whole in a sentence. It never says that all is well while anything is unknown.

use observer::{LiveModule, NetworkState};
use wire::{FaultState, FaultTransition};

use super::trouble::troubles;
use crate::view::View;

/// Faults, what is verified, what is unknown and because of whom.
pub(super) fn sentence(view: &View<'_>) -> String {
    let modules = &view.scene.modules;
    if modules.is_empty() {
        return match view.scene.network {
            NetworkState::Open => "No module answers".to_owned(),
            _ => "No network: nothing is known".to_owned(),
        };
    }
    let components: Vec<&FaultTransition> = view.scene.components().collect();
    let count = |state| components.iter().filter(|component| component.state() == state).count();
    let verified = modules.iter().map(|module| module.picture.verified()).sum::<usize>();
    let unverified = count(FaultState::Normal) - verified;
    let mut parts = match components.len() {
        0 => vec!["No component is known".to_owned()],
        count => vec![
            faults(&components),
            format!("{verified} of {} verified", plural(count, "component")),
        ],
    };
    let others = [
        (unverified, "normal, not verified"),
        (count(FaultState::Unconfirmed), "unconfirmed"),
        (count(FaultState::Explained), "explained"),
        (count(FaultState::Tentative), "changed a moment ago"),
        (count(FaultState::Unknown), "unknown"),
    ];
    parts.extend(others.iter().filter(|(n, _)| *n > 0).map(|(n, words)| format!("{n} {words}")));
    let mut sentence = parts.join(", ");
    let because: Vec<String> = modules.iter().filter_map(because).collect();
    if !because.is_empty() {
        sentence.push_str(": ");
        sentence.push_str(&because.join(", "));
    }
    if view.scene.network != NetworkState::Open && !components.is_empty() {
        sentence.push_str("; as it was when there was a network");
    }
    sentence
}

fn faults(components: &[&FaultTransition]) -> String {
    let faults: Vec<_> =
        components.iter().filter(|component| component.state().is_fault()).collect();
    let acknowledged = faults.iter().filter(|c| c.state() == FaultState::Acknowledged).count();
    let aside = components.iter().filter(|component| component.aside().is_some()).count();
    let mut words = match faults.len() {
        0 => "No fault known".to_owned(),
        count => plural(count, "fault"),
    };
    if acknowledged > 0 {
        words = format!("{words} ({acknowledged} acknowledged)");
    }
    if aside > 0 {
        words = format!("{words}, {} set aside", plural(aside, "component"));
    }
    words
}

/// The module that keeps something from being known.
fn because(module: &LiveModule) -> Option<String> {
    let name = &module.picture.member.module;
    if module.silent_since_unix_ns.is_some() {
        return Some(format!("{name} is not heard"));
    }
    let worst = troubles(module).into_iter().next()?;
    Some(format!("{name}: {}", worst.words))
}

fn plural(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}
