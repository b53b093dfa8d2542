//! The outcome of a case and, if it is not exact, the reasons.

use vocabulary::{Step, fault::FaultKind};

use super::account::{Account, ChangeFate, Changed, FaultyChannel};
use super::words::times;
use super::{LineKind, StoryLine};

/// A gage whose reading is not this many times its noise loses little when it reads nothing.
const CLEAR_READING: f64 = 10.0;

/// The last lines of a story.
pub(super) fn render(account: &Account) -> Vec<StoryLine> {
    let mut lines = OutcomeLines { account, lines: Vec::new() };
    let is_named = |faulty: &FaultyChannel| account.named(faulty).is_some();
    let is_exact = account.faulty.iter().all(is_named) && account.wrong().next().is_none();
    for faulty in &account.faulty {
        lines.verdict(faulty, is_exact);
        if !is_named(faulty) {
            lines.missed(faulty);
        }
    }
    lines.wrong();
    if account.faulty.is_empty() && account.diagnosed.is_empty() {
        lines.add(LineKind::Outcome, "nothing was faulty and nothing was named".to_owned());
    }
    lines.lines
}

struct OutcomeLines<'a> {
    account: &'a Account<'a>,
    lines: Vec<StoryLine>,
}

impl OutcomeLines<'_> {
    fn add(&mut self, kind: LineKind, text: String) {
        let step = self.account.end;
        self.lines.push(StoryLine { time_s: self.account.clock().seconds(step), step, kind, text });
    }

    fn verdict(&mut self, faulty: &FaultyChannel, is_exact: bool) {
        let clock = self.account.clock();
        let component = &faulty.first.component;
        let since = |step: Step| clock.span(step.since(faulty.first.at));
        let text = match self.account.named(faulty) {
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
        };
        self.add(LineKind::Outcome, text);
    }

    fn wrong(&mut self) {
        let wrong: Vec<_> = self.account.wrong().cloned().collect();
        for wrong in wrong {
            let first = self.account.faults.iter().map(|fault| fault.at).min();
            let text = match first.filter(|onset| wrong.detection < *onset) {
                Some(onset) => format!(
                    "false alarm: {} was named for a change {} before the fault began",
                    wrong.component,
                    self.account.clock().span(onset.since(wrong.detection)),
                ),
                None => format!("wrong: {} is healthy and was named", wrong.component),
            };
            self.add(LineKind::Because, text);
        }
    }

    fn missed(&mut self, faulty: &FaultyChannel) {
        let (component, onset) = (&faulty.first.component, faulty.first.at);
        let mut changes = self.account.changes.iter();
        let reason = match changes.find(|c| c.step >= onset && c.component == *component) {
            Some(changed) => self.why_not_named(changed),
            None => self.why_not_changed(faulty),
        };
        self.add(LineKind::Because, reason);
        if let Some(reading) = faint_reading(faulty) {
            self.add(LineKind::Because, reading);
        }
    }

    fn why_not_named(&self, changed: &Changed) -> String {
        let clock = self.account.clock();
        let at = clock.time(changed.step);
        match &changed.fate {
            ChangeFate::Explained { root, .. } => {
                format!("its change at {at} was explained by {}", root.component)
            }
            ChangeFate::Known { since } => format!(
                "it had been named already, for its change at {}, and is not judged again",
                clock.time(*since)
            ),
            ChangeFate::Open | ChangeFate::Fault { .. } => {
                format!("its change at {at} was not judged before the run ended")
            }
        }
    }

    fn why_not_changed(&self, faulty: &FaultyChannel) -> String {
        match faulty.peak {
            Some((step, ratio)) if ratio < 1.0 => format!(
                "its divergence never reached its threshold: the largest after the fault began was \
                 {} the threshold, at {}",
                times(ratio),
                self.account.clock().time(step)
            ),
            Some((_, ratio)) => format!(
                "its divergence was above its threshold before the fault began, and going up to \
                 {} the threshold is no new change",
                times(ratio)
            ),
            None => "the run ended before the fault began".to_owned(),
        }
    }
}

/// Why a gage that reads nothing any more is not missed.
fn faint_reading(faulty: &FaultyChannel) -> Option<String> {
    let reading = faulty.reading_over_noise?;
    let silent = faulty.first.fault.kind() == FaultKind::ZeroOutput;
    (silent && reading < CLEAR_READING).then(|| {
        format!(
            "right before the fault the gage read only {} its noise: to read nothing instead \
             changes little",
            times(reading)
        )
    })
}
