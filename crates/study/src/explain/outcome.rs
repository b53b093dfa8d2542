//! The outcome of a case and, if it is not exact, the reasons.

use vocabulary::{Step, fault::FaultKind};

use super::LineKind;
use super::account::{Account, ChangeFate, FaultyChannel};
use super::words::times;
use crate::group::Diagnosed;
use crate::rig::TimedFault;

/// A gage whose reading is below this multiple of its noise hardly changes when its output becomes zero.
const CLEAR_READING: f64 = 10.0;

/// The last lines of an explanation, at the end of the run.
pub(super) fn render(account: &Account) -> Vec<(LineKind, String)> {
    let is_named = |faulty: &FaultyChannel| account.named(faulty).is_some();
    let is_exact = account.faulty.iter().all(is_named) && account.wrong().next().is_none();
    let mut lines = Vec::new();
    for faulty in &account.faulty {
        lines.push((LineKind::Outcome, verdict(account, faulty, is_exact)));
        if !is_named(faulty) {
            lines.push((LineKind::Because, why_missed(account, faulty)));
            lines.extend(faint_reading(faulty).map(|text| (LineKind::Because, text)));
        }
    }
    lines.extend(account.wrong().map(|wrong| (LineKind::Because, why_wrong(account, wrong))));
    if account.faulty.is_empty() && account.diagnosed.is_empty() {
        lines.push((LineKind::Outcome, "nothing was faulty and nothing was named".to_owned()));
    }
    lines
}

fn verdict(account: &Account, faulty: &FaultyChannel, is_exact: bool) -> String {
    let component = &faulty.first.component;
    let since = |step: Step| account.clock().span(step.since(faulty.first.at));
    match account.named(faulty) {
        None => format!("missed: {component} is faulty and was not named"),
        Some(named) if is_exact => format!(
            "exact: {component} was named and nothing healthy; changed {}, named {} after the fault began",
            since(named.detection),
            since(named.decided),
        ),
        Some(named) => format!(
            "not exact: {component} was named {} after the fault began",
            since(named.decided)
        ),
    }
}

fn why_wrong(account: &Account, wrong: &Diagnosed) -> String {
    let first = account.faults.iter().map(|fault| fault.at).min();
    match first.filter(|onset| wrong.detection < *onset) {
        Some(onset) => format!(
            "false alarm: {} was named for a change {} before the fault began",
            wrong.component,
            account.clock().span(onset.since(wrong.detection)),
        ),
        None => format!("wrong: {} is healthy and was named", wrong.component),
    }
}

fn why_missed(account: &Account, faulty: &FaultyChannel) -> String {
    let TimedFault { component, at: onset, .. } = &faulty.first;
    let clock = account.clock();
    let mut changes = account.changes.iter();
    let Some(changed) = changes.find(|c| c.step >= *onset && c.component == *component) else {
        return why_not_changed(account, faulty);
    };
    let at = clock.time(changed.step);
    match &changed.fate {
        ChangeFate::Explained { by, .. } => format!("its change at {at} was explained by {by}"),
        ChangeFate::Known { since } => format!(
            "it had been named already, for its change at {}, and is not judged again",
            clock.time(*since)
        ),
        ChangeFate::Open | ChangeFate::Fault { .. } => {
            format!("its change at {at} was not judged before the run ended")
        }
    }
}

fn why_not_changed(account: &Account, faulty: &FaultyChannel) -> String {
    match faulty.peak {
        Some((step, ratio)) if ratio < 1.0 => format!(
            "its divergence never reached its threshold: the largest after the fault began was \
             {} the threshold, at {}",
            times(ratio),
            account.clock().time(step)
        ),
        Some((_, ratio)) => format!(
            "its divergence was above its threshold before the fault began, and going up to \
             {} the threshold is not a new change",
            times(ratio)
        ),
        None => "the run ended before the fault began".to_owned(),
    }
}

/// Why the zero output of a gage was not detected.
fn faint_reading(faulty: &FaultyChannel) -> Option<String> {
    let reading = faulty.reading.as_ref()?.over_noise();
    let silent = faulty.first.fault.kind() == FaultKind::ZeroOutput;
    (silent && reading < CLEAR_READING).then(|| {
        format!(
            "right before the fault the gage read only {} its noise: to read nothing instead \
             changes little",
            times(reading)
        )
    })
}
